"""Batches: many runs of a system with different parameters, interpreted or compiled."""
