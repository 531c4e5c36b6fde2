"""Exchange: calibration pages in the formats of measurement and calibration tools."""
