"""Satisfiability of guards over the reals: queries, linear elimination, sampling, z3."""
