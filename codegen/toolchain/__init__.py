"""External tools: the C compiler, target machines, templates, caches of compiled programs."""
