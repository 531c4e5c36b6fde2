"""Satisfiability of guards over the reals: queries, elimination, sampling, z3."""
