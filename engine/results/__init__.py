"""Results of a run: trajectories, files, comparisons and plots."""
