"""Experiments that discriminate between candidates which recordings do not separate."""
