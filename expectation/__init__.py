"""Tests of specs: read expectations, evaluate them on runs, measure coverage, trace
requirements.
"""
