"""Compiled one-step predictors: a model follows recordings, corrected by Kalman gains."""
