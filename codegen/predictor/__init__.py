"""Compiled one-step predictors: a model that follows recordings and is corrected by Kalman
gains.
"""
