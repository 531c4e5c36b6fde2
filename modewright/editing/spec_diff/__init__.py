"""Semantic differences of two specs: comparison and rendering."""
