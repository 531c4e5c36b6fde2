"""Reading of whole documents: automata, systems, scenarios, recording maps."""
