"""Recordings as arrays: resampled, stacked, with estimates of noise and spectra."""
