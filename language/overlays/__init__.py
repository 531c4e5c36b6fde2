"""Overlays on a document: variants, effects, calibrations and other values of parameters."""
