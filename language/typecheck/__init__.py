"""Types, dimensions and value ranges of expressions."""
