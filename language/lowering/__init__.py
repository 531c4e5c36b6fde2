"""Lowering of the parts of a model: expressions, actions, waits, delays, events and ranges."""
