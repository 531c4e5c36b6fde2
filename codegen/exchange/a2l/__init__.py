"""Descriptions of generated C for measurement and calibration tools (ASAM)."""
