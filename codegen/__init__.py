"""C code generation: prints a Program as C99, compiles it, and tests and proves the result."""
