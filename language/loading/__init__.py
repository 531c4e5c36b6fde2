"""Loading of whole documents: automata, systems, scenarios, calibration pages, recording maps."""
