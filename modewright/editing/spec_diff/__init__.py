"""Semantic differences between two versions of a spec."""
