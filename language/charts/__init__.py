"""Lowering of charts: selection of transitions, exits, entries and micro-steps."""
