"""Measurement: evaluate the measures of a study from the events and signals of a run."""
