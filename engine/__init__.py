"""Interprets a Program: micro-steps, crossings, scenarios, trajectories."""
