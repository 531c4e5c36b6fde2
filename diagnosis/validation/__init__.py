"""Validation of a diagnosis: residual autocorrelation, constancy, free simulation."""
