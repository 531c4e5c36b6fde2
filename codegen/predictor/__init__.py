"""Compiled one-step predictors: a model that follows recordings, with Kalman gains."""
