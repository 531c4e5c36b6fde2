"""Overlays on a document: variants, effects, calibrations, values at points."""
