"""Execution of continuous automata: major steps, located events, range and invariant monitors."""
