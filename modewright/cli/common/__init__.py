"""Shared parts of commands: options, console, exit codes, interruption."""
