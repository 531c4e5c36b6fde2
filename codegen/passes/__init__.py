"""Passes over a Program, and analyses of it, that only the C generator uses."""
