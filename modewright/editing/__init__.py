"""Editing: what may stand where in a spec, its JSON Schema, its layout, what differs."""
