"""Proofs: what tools of others say of the C of a Program."""
