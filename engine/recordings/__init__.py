"""Recordings: readers of CSV, Parquet, MF4 and CAN logs."""
