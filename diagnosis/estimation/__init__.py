"""Estimation of parameters from recordings by the innovations likelihood."""
