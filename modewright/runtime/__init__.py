"""Runtime: compiled runs, BLAS threads, garbage collection and output files."""
