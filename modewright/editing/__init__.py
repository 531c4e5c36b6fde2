"""Editing: shapes of keys, JSON Schema, formatter and semantic differences of specs."""
