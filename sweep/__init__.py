"""Studies: simulate many variants of a system, store the results in Parquet files, summarise
them.
"""
