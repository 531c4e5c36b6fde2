"""Command line: the application and its commands."""
