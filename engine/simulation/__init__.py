"""Simulation and replay of a system: schedule, wiring, sensors and stimuli."""
