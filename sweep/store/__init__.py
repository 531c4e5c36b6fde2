"""Store of results: manifest, Parquet files of blocks, and access to columns."""
