"""Definition of a study: variables, distributions, measures and plots, read from YAML."""
