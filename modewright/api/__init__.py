"""The public functions: simulate, check, generate, diagnose, sweep and others."""
