"""Validation of a diagnosis: residual autocorrelation, free simulation, oscillation."""
