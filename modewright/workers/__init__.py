"""Worker processes of studies."""
