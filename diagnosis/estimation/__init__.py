"""Estimation of parameters and noise from recordings by the innovations likelihood."""
