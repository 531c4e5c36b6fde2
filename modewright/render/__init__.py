"""Rendering of results for people: tables, pages, SARIF."""
