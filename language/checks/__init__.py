"""Checks of a model: determinism, reachability, ranges, writers, instantaneous cycles."""
