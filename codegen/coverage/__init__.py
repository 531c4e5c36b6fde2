"""MC/DC coverage of generated C: counters of clang, inputs found by libFuzzer, boundary values."""
