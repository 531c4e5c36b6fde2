"""Lowering of charts: selection of transitions, exit, entry, micro-steps."""
