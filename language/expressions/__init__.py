"""Expressions: units, syntax trees, parser, symbolic simplification and derivatives."""
