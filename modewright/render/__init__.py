"""Rendering: convert results to text, tables, HTML pages, SARIF and JSON."""
