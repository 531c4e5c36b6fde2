"""Shelf: fits of a diagnosis kept in files, so that one that was ended goes on where it was.

A fit is determined by what it is made from - the code, the model, the recordings, where it starts:
a hash of these is its name. What was kept has the bits of what would be made.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from diagnosis.candidate import Candidate
from diagnosis.estimate import Estimate, outcome_at
from diagnosis.normal import Normal
from diagnosis.point import Point
from diagnosis.prediction import Gains, Noises
from diagnosis.recipe import code_digest, write_whole
from diagnosis.series import Series

Arrays = Mapping[str, Any]
NORMAL = tuple(field.name for field in dataclasses.fields(Normal))


@dataclasses.dataclass(frozen=True)
class Shelf:
    """Where fits are kept; nowhere without a folder. `key` is the hash of the model.

    `before` is called before a fit is made: it may raise what ends the diagnosis.
    """

    folder: Path | None = None
    key: str = ""
    before: Callable[[], None] = lambda: None

    def kept(
        self,
        words: str,
        candidate: Candidate,
        series: Sequence[Series],
        given: Sequence[object],
        make: Callable[[], Estimate],
    ) -> Estimate:
        """Return a fit of a candidate that follows from `given`: as it was kept, else made now."""
        if self.folder is None:
            self.before()
            return make()
        name = hash_of(words, code_digest(), self.key, candidate, tuple(series), *given)
        path = self.folder / f"{name}.npz"
        with suppress(OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return _estimate(candidate, series, dict(np.load(io.BytesIO(path.read_bytes()))))
        self.before()
        found = make()
        with suppress(OSError):  # a full disk is no reason to stop
            data = io.BytesIO()
            np.savez(data, **_arrays(found))
            self.folder.mkdir(parents=True, exist_ok=True)
            write_whole(path, data.getvalue())
        return found


NOWHERE = Shelf()


def hash_of(*values: object) -> str:
    """Return a hash of values; equal bits have equal hashes."""
    digest = hashlib.sha256()
    for value in values:
        _into(digest, value)
    return digest.hexdigest()[:32]


def _into(digest: Any, value: object) -> None:
    digest.update(f"{type(value).__name__}(".encode())
    if isinstance(value, Candidate):
        _into(digest, (*(layer.id for layer in value.layers), value.recipe))
    elif isinstance(value, np.ndarray):
        digest.update(f"{value.dtype}{value.shape}".encode() + value.tobytes())
    elif isinstance(value, Mapping):
        for key in sorted(value):
            _into(digest, key)
            _into(digest, value[key])
    elif isinstance(value, (tuple, list)):
        for one in value:
            _into(digest, one)
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            _into(digest, getattr(value, field.name))
    elif value is None or isinstance(value, (str, int, float, Fraction)):
        digest.update(repr(value).encode())
    else:
        raise TypeError(f"a fit cannot be named by a {type(value).__name__}")
    digest.update(b")")


def _arrays(one: Estimate) -> Arrays:
    """Return an estimate as arrays, but for what its outcome follows from."""
    drifts = one.noises.drifts
    found: dict[str, Any] = {
        "shared": one.point.shared,
        "own": one.point.own,
        "cost": one.cost,
        "first": one.gains.first,
        "steady": one.gains.steady,
        "noise_seen": one.noises.seen,
        "noise_inputs": one.noises.inputs,
        "noise_limits": one.noises.limits,
        "is_alone": one.noises.is_alone,
        "drift_names": np.array(list(drifts), dtype=str),
        "drift_levels": np.array(list(drifts.values()), dtype=float),
        "limits": one.outcome.limits,
        "columns": np.array(list(one.columns), dtype=str),
    }
    if one.normal is not None:
        found |= {f"normal_{name}": getattr(one.normal, name) for name in NORMAL}
    found |= {f"column_{name}": changes for name, changes in one.columns.items()}
    return found


def _estimate(candidate: Candidate, series: Sequence[Series], of: Arrays) -> Estimate:
    """Return the estimate that arrays were made from."""
    drifts = {
        str(name): float(level)
        for name, level in zip(of["drift_names"], of["drift_levels"], strict=True)
    }
    is_alone = bool(of["is_alone"])
    noises = Noises(of["noise_seen"], of["noise_inputs"], drifts, of["limits"], is_alone)
    point, gains = Point(of["shared"], of["own"]), Gains(of["first"], of["steady"])
    normal = None
    if "normal_a" in of:
        normal = Normal(**{name: of[f"normal_{name}"] for name in NORMAL})
    columns = {str(name): of[f"column_{name}"] for name in of["columns"]}
    blank: Any = None
    found = Estimate(candidate, point, float(of["cost"]), blank, gains, noises, normal, columns)
    outcome = outcome_at(found, series, point)
    noises = dataclasses.replace(noises, limits=of["noise_limits"])
    return dataclasses.replace(found, outcome=outcome, noises=noises)
