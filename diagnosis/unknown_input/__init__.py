"""Detection of an unknown input that acts in intervals."""
