"""Compiled simulations of whole systems, and of a Program block by block."""
