"""Analysis of a study: summaries, confidence intervals, sensitivity indices and plots."""
