"""A2L (ASAM MCD-2 MC): descriptions of generated C for measurement and calibration tools."""
