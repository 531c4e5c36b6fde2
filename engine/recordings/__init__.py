"""Readers of recordings: CSV, Parquet, MF4 and CAN logs."""
