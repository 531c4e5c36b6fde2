"""The report of a diagnosis: sentences, tables, figures, files."""
