"""Checks of recordings against a model: units, signs, clocks, columns, excitation."""
