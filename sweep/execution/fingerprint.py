"""Fingerprint: the versions of code, packages and processor that determine the bits of results."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable, Mapping
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import ModuleType

import codegen
import engine
import language
import sweep

CODE_PACKAGES = (language, engine, codegen, sweep)
"""Packages whose files belong to the fingerprint."""
CODE_SUFFIXES = (".py", ".lark", ".txt", ".jinja", ".h")
"""Suffixes of the files that belong to the fingerprint."""
LIBRARIES = ("numpy", "scipy", "filterpy", "pyarrow")
"""Libraries that determine noise and Sobol points (numpy, scipy), gains (filterpy) and files."""
SHOWN_DIGITS = 12
"""Hexadecimal digits of a digest in messages."""


@lru_cache(maxsize=1)
def fingerprint() -> Mapping[str, str]:
    """Return the versions and digests of this process by part; equal ones give equal bits.

    The parts are `modewright` (digest of the code files of CODE_PACKAGES), `Python` (major.minor),
    `processor`, and each of LIBRARIES (`not installed` if absent). Computed once in a process.
    """
    found = {"modewright": _code_digest(CODE_PACKAGES)}
    found["Python"] = ".".join(platform.python_version_tuple()[:2])
    found["processor"] = platform.machine()
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def describe_differences(expected: Mapping[str, str], actual: Mapping[str, str]) -> str:
    """Return the parts whose actual value differs from the expected one, as text.

    The form is `name actual instead of expected`, separated by commas; values are cut at
    SHOWN_DIGITS characters, a missing one is `unknown`. Empty if none differs; further parts of
    `actual` do not count.
    """
    parts = [
        f"{name} {actual.get(name, 'unknown')[:SHOWN_DIGITS]} instead of {value[:SHOWN_DIGITS]}"
        for name, value in expected.items()
        if actual.get(name) != value
    ]
    return ", ".join(parts)


def _code_digest(packages: Iterable[ModuleType]) -> str:
    """Return the SHA-256 digest of the code files of packages, with their names.

    The wheel has another digest than the repository, because names and imports differ.
    """
    total = hashlib.sha256()
    for package in packages:
        home = Path(str(package.__file__)).parent
        for path in sorted(home.rglob("*")):
            if path.suffix in CODE_SUFFIXES and path.is_file():
                name = f"{home.name}/{path.relative_to(home).as_posix()}"
                total.update(name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()
