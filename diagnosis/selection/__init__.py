"""Selection of effects: inter-sample behaviour, screening, comparison, forward selection."""
