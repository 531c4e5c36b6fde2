"""Lowering of observers: Kalman filters with a steady or a recursive gain."""
