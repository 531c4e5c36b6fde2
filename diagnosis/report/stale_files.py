"""Stale files: files of an earlier diagnosis in a folder that the present one may not overwrite."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path

from diagnosis.criterion.threshold import FORMAT as THRESHOLDS
from diagnosis.report.reproduction import SCENARIO, VARIANT, WINDOW
from diagnosis.result.verdict import FORMAT as VERDICT

FIGURE_NAMES = (
    *("window_train", "window_held_out", "missing", "whiteness", "places", "shuffle", "plan"),
)
"""Names of the figures of a report; the verdict determines which of them are drawn."""


def find_stale_files(folder: Path) -> list[Path]:
    """Return the files of an earlier diagnosis in a folder that are not written in every case.

    Only a folder with a `verdict.json` has any. All but figures count only if their contents
    identify them; others belong to the user.
    """
    if _json_format(folder / "verdict.json") != VERDICT:
        return []
    found = [folder / f"{name}.{ending}" for name in FIGURE_NAMES for ending in ("svg", "png")]
    found += [folder / name for name, is_ours in OWNERSHIP_CHECKS.items() if is_ours(folder / name)]
    formulas = sorted(folder.glob("unknown_*_at_*.yaml"))
    found += [path for path in formulas if f"effect: {path.stem}" in _read_text(path).splitlines()]
    return [path for path in found if path.is_file()]


def _is_scenario(path: Path) -> bool:
    """Return whether a file is the scenario of a report."""
    return {f"of: {VARIANT}", f"  file: {WINDOW}"} <= set(_read_text(path).splitlines())


def _is_window(path: Path) -> bool:
    """Return whether a file is the CSV of a worst window."""
    names = _read_text(path).partition("\n")[0].split(",")
    return names[0] == "t_s" and names[-1].endswith("_with")


OWNERSHIP_CHECKS: Mapping[str, Callable[[Path], bool]] = {
    SCENARIO: _is_scenario,
    WINDOW: _is_window,
    "thresholds.json": lambda path: _json_format(path) == THRESHOLDS,
}


def _json_format(path: Path) -> object:
    """Return the `format` of a JSON file, None if it has none or is invalid."""
    try:
        found = json.loads(_read_text(path))
    except (ValueError, RecursionError):
        return None
    return found.get("format") if isinstance(found, dict) else None


def _read_text(path: Path) -> str:
    """Return the text of a file, "" if it cannot be read."""
    try:
        return path.read_text("utf-8") if path.is_file() else ""
    except (OSError, ValueError):
        return ""
