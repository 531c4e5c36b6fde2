"""Criteria that compare models: gain, explained share, effective sample size, thresholds."""
