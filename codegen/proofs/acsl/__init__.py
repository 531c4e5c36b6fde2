"""ACSL contracts of generated functions, proven by the WP plug-in of Frama-C."""
