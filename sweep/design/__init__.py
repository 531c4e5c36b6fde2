"""The design of a study: from the number of a variant to its values."""
