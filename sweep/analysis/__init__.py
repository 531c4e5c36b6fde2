"""Analysis of a study: summaries, intervals, sensitivity, plots."""
