"""Discovery of a formula for what no effect of the library explains."""
