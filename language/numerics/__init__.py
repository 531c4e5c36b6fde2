"""Numbers computed at check time, and elementary functions with fixed bits."""
