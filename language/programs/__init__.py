"""Assembly of whole Programs: sampled and continuous automata, systems."""
