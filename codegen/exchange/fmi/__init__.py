"""Functional Mock-up Interface: a Program as a co-simulation FMU of FMI 2.0 or 3.0."""
