"""Recordings of an electric driveline that lacks or has one of seventeen effects."""
