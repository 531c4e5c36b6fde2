"""Design of a study: map the number of a variant to its values."""
