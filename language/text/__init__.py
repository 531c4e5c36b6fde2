"""Text of a project: files, YAML nodes with places, diagnostics, provenance."""
