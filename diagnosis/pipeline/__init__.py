"""The whole procedure: usable recordings, recalibration, selection, decision, validation."""
