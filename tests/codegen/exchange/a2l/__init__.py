"""Tests of descriptions for measurement and calibration tools."""
