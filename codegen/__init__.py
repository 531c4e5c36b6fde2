"""Prints a Program as C and builds it."""
