"""Assembly of whole Programs: sampled automata, continuous automata and systems."""
