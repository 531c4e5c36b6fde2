"""From YAML text to a checked Model and a lowered Program."""
