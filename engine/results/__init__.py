"""Results of a run: the trajectory, files, comparison and plots."""
