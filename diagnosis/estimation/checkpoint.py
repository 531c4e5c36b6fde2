"""Fit cache: estimates stored in files, so that an interrupted diagnosis continues where it was.

The file name is a hash of everything that determines a fit: the code, the model, the recordings and
the start. A loaded estimate is bit-identical to a computed one.
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

from codegen.toolchain.build_cache import read_sealed, write_sealed
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, predict_with_gains_of
from diagnosis.estimation.innovations import KalmanGains, NoiseLevels
from diagnosis.estimation.normal_equations import NormalEquations
from diagnosis.model.candidate import Candidate
from diagnosis.model.compile_cache import code_digest
from diagnosis.model.parameter_vector import ParameterVector

Arrays = Mapping[str, Any]
NORMAL_FIELDS = tuple(field.name for field in dataclasses.fields(NormalEquations))


@dataclasses.dataclass(frozen=True)
class FitCache:
    """A cache of fits in `folder`; without a folder nothing is stored.

    `model_key` is a hash of the model.

    `before_fit` is called before each computed fit; it may raise to end the diagnosis.
    """

    folder: Path | None = None
    model_key: str = ""
    before_fit: Callable[[], None] = lambda: None

    def load_or_fit(
        self,
        label: str,
        candidate: Candidate,
        series: Sequence[SampledRecording],
        dependencies: Sequence[object],
        fit: Callable[[], Estimate],
    ) -> Estimate:
        """Return the stored estimate of a fit, or compute it with `fit` and store it.

        The file is `<hash>.npz` in `folder`; the hash is of `label`, the code, `model_key`, the
        candidate, the recordings and `dependencies`. A damaged file is computed again, and a
        failure to write is ignored. `before_fit` is called before `fit`, not for a stored estimate;
        what it or `fit` raises is passed on. Without a folder `fit` is always called.
        """
        if self.folder is None:
            self.before_fit()
            return fit()
        name = hash_of(
            label, code_digest(), self.model_key, candidate, tuple(series), *dependencies
        )
        path = self.folder / f"{name}.npz"
        with suppress(OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            stored = io.BytesIO(read_sealed(path) or b"")
            return _from_arrays(candidate, series, dict(np.load(stored)))
        self.before_fit()
        estimate = fit()
        with suppress(OSError):  # a full disk does not end the diagnosis
            data = io.BytesIO()
            np.savez(data, **_to_arrays(estimate))
            self.folder.mkdir(parents=True, exist_ok=True)
            write_sealed(path, data.getvalue())
        return estimate


NO_CACHE = FitCache()


def hash_of(*values: object) -> str:
    """Return a hash (32 hex digits of SHA-256) of values; equal bits and types have equal hashes.

    Supported are candidates (by effect identities and compiled model), arrays, mappings (in sorted
    order of keys), tuples, lists, dataclasses, numbers, Fractions, strings and None; other types
    raise TypeError.
    """
    digest = hashlib.sha256()
    for value in values:
        _update_digest(digest, value)
    return digest.hexdigest()[:32]


def _update_digest(digest: Any, value: object) -> None:
    """Add the type and the bits of a value to a digest, recursively."""
    digest.update(f"{type(value).__name__}(".encode())
    if isinstance(value, Candidate):
        _update_digest(
            digest, (*(placed_effect.id for placed_effect in value.placed_effects), value.compiled)
        )
    elif isinstance(value, np.ndarray):
        digest.update(f"{value.dtype}{value.shape}".encode() + value.tobytes())
    elif isinstance(value, Mapping):
        for key in sorted(value):
            _update_digest(digest, key)
            _update_digest(digest, value[key])
    elif isinstance(value, (tuple, list)):
        for one in value:
            _update_digest(digest, one)
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            _update_digest(digest, getattr(value, field.name))
    elif value is None or isinstance(value, (str, int, float, Fraction)):
        digest.update(repr(value).encode())
    else:
        raise TypeError(f"a fit cannot be named by a {type(value).__name__}")
    digest.update(b")")


def _to_arrays(estimate: Estimate) -> Arrays:
    """Return an estimate as named arrays, without the prediction, which can be computed again."""
    drifts = estimate.noise_levels.process
    arrays: dict[str, Any] = {
        "shared": estimate.point.shared,
        "own": estimate.point.per_recording,
        "cost": estimate.cost,
        "first": estimate.gains.transient,
        "steady": estimate.gains.steady_state,
        "noise_seen": estimate.noise_levels.outputs,
        "noise_inputs": estimate.noise_levels.inputs,
        "noise_limits": estimate.noise_levels.huber_limits,
        "is_alone": estimate.noise_levels.is_output_error,
        "gain_scale": estimate.noise_levels.gain_scale,
        "drift_names": np.array(list(drifts), dtype=str),
        "drift_levels": np.array(list(drifts.values()), dtype=float),
        "limits": estimate.prediction.huber_limits,
        "columns": np.array(list(estimate.jacobian), dtype=str),
    }
    if estimate.normal_equations is not None:
        arrays |= {
            f"normal_{name}": getattr(estimate.normal_equations, name) for name in NORMAL_FIELDS
        }
    arrays |= {f"column_{name}": changes for name, changes in estimate.jacobian.items()}
    return arrays


def _from_arrays(
    candidate: Candidate, series: Sequence[SampledRecording], arrays: Arrays
) -> Estimate:
    """Return the estimate stored in arrays; its prediction is computed with the stored gains."""
    drifts = {
        str(name): float(level)
        for name, level in zip(arrays["drift_names"], arrays["drift_levels"], strict=True)
    }
    is_alone = bool(arrays["is_alone"])
    noise_levels = NoiseLevels(
        arrays["noise_seen"],
        arrays["noise_inputs"],
        drifts,
        arrays["limits"],
        is_alone,
        float(arrays["gain_scale"]),
    )
    point, gains = (
        ParameterVector(arrays["shared"], arrays["own"]),
        KalmanGains(arrays["first"], arrays["steady"]),
    )
    normal = None
    if "normal_a" in arrays:
        normal = NormalEquations(**{name: arrays[f"normal_{name}"] for name in NORMAL_FIELDS})
    columns = {str(name): arrays[f"column_{name}"] for name in arrays["columns"]}
    blank: Any = None
    estimate = Estimate(
        candidate, point, float(arrays["cost"]), blank, gains, noise_levels, normal, columns
    )
    prediction = predict_with_gains_of(estimate, series, point)
    noise_levels = dataclasses.replace(noise_levels, huber_limits=arrays["noise_limits"])
    return dataclasses.replace(estimate, prediction=prediction, noise_levels=noise_levels)
