"""Diagnosis: recordings against simulation - locate the mismatch, name the physics, model it."""
