"""expectation: tests of specs - what a run is expected to do, and what became of it."""
