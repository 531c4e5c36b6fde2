"""What commands share: options, console, exit codes, interruption."""
