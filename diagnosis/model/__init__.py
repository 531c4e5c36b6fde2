"""Candidate models: a base model with effects placed on it, compiled, with its parameters."""
