"""Runs the engine and the compiled code side by side, bit for bit."""
