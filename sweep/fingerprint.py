"""Fingerprint: what the bits of results depend on beside the study - code, packages, processor."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

CODE = ("language", "engine", "codegen", "sweep")
SUFFIXES = (".py", ".lark", ".txt", ".jinja", ".h")
PACKAGES = ("numpy", "scipy", "filterpy", "pyarrow")
"""Noise and Sobol points are numpy's and scipy's, gains filterpy's, files pyarrow's."""
DIGITS = 12
"""Hexadecimal digits of a digest that are told."""


@lru_cache(maxsize=1)
def fingerprint() -> Mapping[str, str]:
    """Return what this process computes with, by part; equal ones give equal bits."""
    found = {"modewright": _code_digest(Path(__file__).resolve().parent.parent)}
    found["Python"] = ".".join(platform.python_version_tuple()[:2])
    found["processor"] = platform.machine()
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def differences(wanted: Mapping[str, str], there: Mapping[str, str]) -> str:
    """Return in words which parts are others than those that are wanted; empty: none."""
    parts = [
        f"{name} {there.get(name, 'unknown')[:DIGITS]} instead of {value[:DIGITS]}"
        for name, value in wanted.items()
        if there.get(name) != value
    ]
    return ", ".join(parts)


def _code_digest(base: Path) -> str:
    total = hashlib.sha256()
    for package in CODE:
        for path in sorted((base / package).rglob("*")):
            if path.suffix in SUFFIXES and path.is_file():
                name = path.relative_to(base).as_posix()
                total.update(name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()
