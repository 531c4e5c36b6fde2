"""Execution of a study: blocks, processes, clusters."""
