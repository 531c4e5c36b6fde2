"""Types, dimensions and ranges of expressions."""
