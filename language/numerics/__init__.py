"""Numerics: elementary functions with fixed bits, evaluation, and small matrices at check time."""
