"""Printing of a Program as C99: names, expressions, statements, structures, modules."""
