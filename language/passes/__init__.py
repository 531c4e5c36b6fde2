"""Passes over a Program: constant folding, common subexpressions."""
