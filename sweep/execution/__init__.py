"""Execution of a study: compute blocks of variants serially, in processes or on a Dask cluster."""
