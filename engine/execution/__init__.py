"""Execution of continuous automata: major steps, located events, monitors of ranges."""
