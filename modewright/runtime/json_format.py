"""JSON format: the entry that names format and schema version of a JSON output."""

from __future__ import annotations

SCHEMA_VERSION = 1
"""Schema version of the JSON outputs; it changes if a key is removed or changes its meaning."""


def format_entry(name: str) -> dict[str, str]:
    """Return the entry with format and schema version for a JSON output of this name.

    It is `{"format": "modewright-<name>/1"}`, as in `verdict.json` and `thresholds.json`.
    """
    return {"format": f"modewright-{name}/{SCHEMA_VERSION}"}
