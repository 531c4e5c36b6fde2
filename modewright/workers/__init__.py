"""Workers: entry points of worker processes of studies."""
