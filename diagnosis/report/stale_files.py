"""Leftover: what an earlier diagnosis has written into a folder that this one may not write."""

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
"""The figures of a report; which of them are drawn follows from the verdict."""


def find_stale_files(folder: Path) -> list[Path]:
    """Return the files of a folder that an earlier diagnosis wrote there, not in every case.

    A folder without a verdict holds none, and of files with common names only those are ours that
    say so themselves: others are a user's.
    """
    if _json_format(folder / "verdict.json") != VERDICT:
        return []
    found = [folder / f"{name}.{ending}" for name in FIGURE_NAMES for ending in ("svg", "png")]
    found += [folder / name for name, is_ours in OWNERSHIP_CHECKS.items() if is_ours(folder / name)]
    found += [path for path in sorted(folder.glob("unknown_*_at_*.yaml")) if _is_effect(path)]
    return [path for path in found if path.is_file()]


def _is_scenario(path: Path) -> bool:
    return {f"of: {VARIANT}", f"  file: {WINDOW}"} <= set(_read_text(path).splitlines())


def _is_window(path: Path) -> bool:
    names = _read_text(path).partition("\n")[0].split(",")
    return names[0] == "t_s" and names[-1].endswith("_with")


def _is_thresholds(path: Path) -> bool:
    return _json_format(path) == THRESHOLDS


def _is_effect(path: Path) -> bool:
    return f"effect: {path.stem}" in _read_text(path).splitlines()


OWNERSHIP_CHECKS: Mapping[str, Callable[[Path], bool]] = {
    SCENARIO: _is_scenario,
    WINDOW: _is_window,
    "thresholds.json": _is_thresholds,
}


def _json_format(path: Path) -> object:
    """Return the format that a JSON file says it has, None where it says none."""
    try:
        found = json.loads(_read_text(path))
    except (ValueError, RecursionError):
        return None
    return found.get("format") if isinstance(found, dict) else None


def _read_text(path: Path) -> str:
    try:
        return path.read_text("utf-8") if path.is_file() else ""
    except (OSError, ValueError):
        return ""
