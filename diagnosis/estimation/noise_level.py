"""Noise levels: the unit of a disturbance, and the level of the ordinary disturbance.

A disturbance of one unit changes a compared output by its own noise after the reference time of the
recordings (`SampledRecording.reference_time`), about 0.2 s for recordings of 10 s.
The level is held while effects are compared, because a fitted one absorbs the physics that is
sought (docs/method.md).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording, UnusableRecordingError
from diagnosis.estimation.innovations import measured_noise_levels
from diagnosis.estimation.operating_point import linearise_near, operating_points
from diagnosis.model.candidate import Candidate

ORDINARY_LEVEL = 0.1
"""Level of the ordinary disturbance of each balance, in units, held in every model."""
HUBER_STDS = 4.0
"""Huber limit of innovations, in their robust standard deviations."""


def disturbance_units(
    candidate: Candidate, series: Sequence[SampledRecording], start: Mapping[str, float]
) -> dict[str, float]:
    """Return the unit [SI] of each disturbance state, by name.

    One unit changes some output by its measured noise after the median reference time, by the model
    linearised at the start of a recording; of several recordings it is the median. A disturbance
    without response has the magnitude of its unit. `start` are values [SI] of parameters. Raises
    UnusableRecordingError if the model cannot be linearised at the start of any recording.
    """
    output_noise = measured_noise_levels(series, {}).outputs
    count = round(float(np.median([one.sample_count(1.0) for one in series])))
    responses = []
    for one in series:
        mode, point = next(iter(operating_points(candidate, [one], None).items()))
        page = candidate.calibration_page(start, one)
        linear = linearise_near(candidate, page, mode, point)
        if linear is not None:
            ahead = linear.c @ np.linalg.matrix_power(linear.phi, count)
            responses.append(np.max(np.abs(ahead) / output_noise[:, np.newaxis], axis=0))
    if not responses:
        names = ", ".join(one.name for one in series)
        raise UnusableRecordingError(f"{names}: the model is unstable where the recordings start")
    response = np.median(responses, axis=0)
    units = {}
    for name in candidate.disturbance_states:
        place = candidate.predictor.states.index(name)
        size = float(response[place])
        units[name] = 1.0 / size if size > 0.0 else float(candidate.state_ranges[place])
    return units
