"""Language server: diagnostics, completion, hover, navigation and rename for specs in editors."""
