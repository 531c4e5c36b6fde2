"""The checked model: automata, charts, systems and queries about them."""
