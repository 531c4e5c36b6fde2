"""Contracts of generated functions in ACSL, proved by the WP plug-in of Frama-C."""
