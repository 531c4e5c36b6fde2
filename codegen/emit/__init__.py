"""Printing of a Program as C: names, expressions, statements, structures, modules."""
