"""Readers of the parts of a document: parameters, variables, modes, transitions, observers."""
