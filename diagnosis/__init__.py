"""Diagnosis: recordings against simulation."""
