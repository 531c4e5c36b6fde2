"""Public API: the functions behind the commands, such as simulate, check, generate and diagnose."""
