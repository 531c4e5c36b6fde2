"""The definition of a study: variables, distributions, measures, plots."""
