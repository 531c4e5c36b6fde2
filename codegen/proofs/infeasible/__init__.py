"""Proofs that no input makes a condition matter: invariants, cutpoints, reachability."""
