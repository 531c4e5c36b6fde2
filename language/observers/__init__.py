"""Lowering of observers: Kalman filters with steady or recursive gain."""
