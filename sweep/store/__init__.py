"""Storage of results: manifest, blocks as files, tables."""
