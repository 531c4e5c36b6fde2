"""Lock-step: runs the engine and the compiled C on the same inputs and compares every bit."""
