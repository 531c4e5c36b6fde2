"""Coverage of generated C: MC/DC counters of clang, inputs found by libFuzzer, boundary values."""
