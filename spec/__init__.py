"""Holds the YAML that travels with the package: systems, scenarios, effects."""
