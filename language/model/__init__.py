"""The checked model: classes of automata, charts and systems, and queries about them."""
