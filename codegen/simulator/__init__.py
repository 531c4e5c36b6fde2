"""Compiled simulations of whole systems, and compiled execution of a Program block by block."""
