"""Measures of a run: statistics, waveforms, observed intervals."""
