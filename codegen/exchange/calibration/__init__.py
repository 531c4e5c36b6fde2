"""Calibration pages in the file formats of measurement and calibration tools: DCM, CDFX, CSV."""
