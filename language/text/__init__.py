"""Text of a project: files, YAML nodes with their places, diagnostics and provenance."""
