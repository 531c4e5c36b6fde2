"""The whole procedure: usable recordings, calibration, selection, decision, validation."""
