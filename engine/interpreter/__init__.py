"""Interpreter: executes Programs by closures for blocks, statements and expressions."""
