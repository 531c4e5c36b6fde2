"""Selection of effects: screening, forward selection, elimination, exchange, thresholds."""
