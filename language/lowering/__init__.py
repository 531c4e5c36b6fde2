"""Lowering of model parts to operations: expressions, waits, resets, delays, ranges."""
