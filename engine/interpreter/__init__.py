"""Interpretation of a Program: blocks, statements and expressions as closures."""
