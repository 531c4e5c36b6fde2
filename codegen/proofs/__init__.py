"""Checks of generated C by external tools: compilers, cppcheck, sanitizers and Frama-C."""
