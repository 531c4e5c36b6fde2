"""Checks of Programs: the properties that every Program has before and after each pass."""
