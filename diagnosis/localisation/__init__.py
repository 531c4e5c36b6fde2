"""Localisation of a mismatch: the balance, element or output at which a disturbance acts."""
