"""Executables around generated C: lock-step records, sanitizers, instruction counts, code size."""
