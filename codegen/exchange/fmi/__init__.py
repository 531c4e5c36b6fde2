"""FMI: a Program as a co-simulation FMU of the Functional Mock-up Interface, 2.0 or 3.0."""
