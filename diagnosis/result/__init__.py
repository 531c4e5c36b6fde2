"""Results of a diagnosis: the verdict and the names of effects."""
