"""Proofs that conditions are infeasible: cutpoints, loop invariants and reachability with z3."""
