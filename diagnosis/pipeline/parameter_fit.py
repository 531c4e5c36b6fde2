"""Parameter fit: parameters of an automaton from recordings, with their uncertainties.

Properties of single recordings are fitted, such as initial states, or absorbed by an observer, such
as slow disturbances (`fit_full_rate`).
"""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.data.sampled_recording import compared_outputs, share_period
from diagnosis.estimation.covariance import correlations_of, marginal_covariance
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.full_rate_fit import (
    FullRateFit,
    fit_full_rate,
    score_first_samples,
)
from diagnosis.estimation.quantity import Quantity
from diagnosis.model.parameter import FreeParameter, format_value
from diagnosis.pipeline.diagnosis_case import Case, build_model_set, file_digests, read_series
from diagnosis.selection.intersample import LogCallback, fit_base
from diagnosis.validation.free_simulation import Misfit, compare_misfits
from language.loading.load import automaton_of
from language.model.automaton import Automaton
from language.model.declaration import Parameter
from language.text.diagnostic import DataError, Problems, Source, Span, suggest_name
from language.text.document import Document, MappingNode
from language.text.node_edit import put_node

BOUND_TOLERANCE = 1e-3
"""Distance from a bound, as a fraction of the range, within which a parameter is at the bound."""
UNDETERMINED_RATIO = 0.8
"""Ratio of posterior to prior standard deviation above which data do not determine a parameter."""
STRONG_CORRELATION = 0.9
"""Correlation from which two parameters can hardly be separated."""


@dataclass(frozen=True)
class FittedParameter:
    """A fitted parameter with its declared value [SI] and how well the data determine it.

    `prior_ratio` is its standard deviation over that of its prior, 1 without information.
    `strongest_correlation` names the parameter with which it correlates most. `note` is a remark.
    """

    name: str
    declared: float
    quantity: Quantity
    prior_ratio: float
    note: str
    strongest_correlation: tuple[str, float] | None = None


@dataclass(frozen=True)
class Fit:
    """Parameters fitted to recordings; `misfits` of free simulation as declared and as fitted.

    `correlations` of pairs are in descending order; `inputs` are digests of the files.
    """

    automaton: Automaton
    parameters: tuple[FittedParameter, ...]
    correlations: Mapping[tuple[str, str], float]
    misfits: Mapping[str, Misfit]
    inputs: Mapping[str, str]
    estimate: Estimate = field(repr=False)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """The names of parameters that the data hardly determine.

        Their `prior_ratio` exceeds `UNDETERMINED_RATIO` (0.8) or is NaN.
        """
        return tuple(
            one.name for one in self.parameters if not one.prior_ratio <= UNDETERMINED_RATIO
        )

    def calibration(self, name: str, date: str = "") -> str:
        """Return the fit as the YAML text of a calibration file, values in SI.

        It has the keys `language`, `calibration` (`name`), `of`, `from` (the recordings), `date`
        (if not empty) and, for each parameter, `{value: ..., std: ...}` with its note as a comment.
        `std` is left out if it is not finite.
        """
        lines = ["language: 1", f"calibration: {name}", f"of: {self.automaton.name}"]
        lines.append(f"from: {json.dumps(', '.join(self.inputs), ensure_ascii=False)}")
        lines += [f"date: {date}"] if date else []
        lines.append("parameters:")
        for one in self.parameters:
            value = format_value(one.quantity.value, self.automaton.parameters[one.name])
            unit = "" if one.quantity.unit == "1" else f" {one.quantity.unit}"
            note = f"  # {one.note}" if one.note else ""
            std = f", std: {one.quantity.std:.3g}{unit}" if math.isfinite(one.quantity.std) else ""
            text = f"{{value: {value}{std}}}"
            lines.append(f"  {one.name}: {text}{note}")
        return "\n".join(lines) + "\n"


def fit(
    case: Case, parameters: Sequence[str] | None = None, log: LogCallback = lambda text: None
) -> Fit:
    """Return the parameters of a case fitted to its recordings: those with a range, or the named.

    No effects are placed, and the better one of the two holds of inputs is used. The first fit of
    `fit_full_rate` whose simulations are not worse than those as declared is taken. The misfits
    compare the declared with the fitted parameters. Raises SpecError (also for a name that is
    unknown or has no range, and without a parameter that has a range), ValueError (no compared
    output, unusable recordings) and MissingToolError.
    """
    automaton = automaton_of(case.document, case.project)
    _require_free_parameter(automaton)
    if parameters is not None:
        document = restrict_free_parameters(case.document, automaton, parameters)
        case = dataclasses.replace(case, document=document)
        automaton = automaton_of(document, case.project)
    seen = compared_outputs(case.mapping, automaton)
    if not seen:
        raise DataError(f"map `{case.mapping.name}` compares no output of `{automaton.name}`")
    case = dataclasses.replace(case, effects=())
    series = share_period(
        [one for path in case.train for one in read_series(path, case, automaton, seen)]
    )
    model_set, estimate = fit_base(build_model_set(case, automaton, series, seen), log)
    fits = fit_full_rate(model_set, estimate, series)
    best = score_first_samples(next((one for one in fits if not _is_worse(one)), fits[0]))
    estimate = best.estimate
    covariance, names = marginal_covariance(estimate)
    correlations = correlations_of(covariance, names)
    stds = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    return Fit(
        automaton,
        _fitted_parameters(automaton, estimate, stds, correlations),
        correlations,
        compare_misfits(best.declared, estimate, best.series),
        file_digests(case, case.train),
        estimate,
    )


def _require_free_parameter(automaton: Automaton) -> None:
    """Raise SpecError, at the place of the spec, if no parameter can be fitted."""
    problems = Problems()
    if not any(map(_can_be_fitted, automaton.parameters.values())):
        label = f"no parameter of `{automaton.name}` has a range to be fitted in"
        problems.error("range", automaton.span, label, "`range: [low, high]` beside its value")
    problems.raise_if_errors()


def _is_worse(one: FullRateFit) -> bool:
    """Return whether the simulations by a fit have larger errors than those as declared.

    The errors of the outputs are compared by their product, as in the likelihood.
    """
    misfits = compare_misfits(one.declared, one.estimate, one.series).values()
    return sum(_log(m.nrmse_after) - _log(m.nrmse_before) for m in misfits) > 0.0


def _log(value: float) -> float:
    """Return the natural logarithm, of the smallest normal number for 0."""
    return math.log(max(value, sys.float_info.min))


def restrict_free_parameters(
    document: Document, automaton: Automaton, names: Sequence[str]
) -> Document:
    """Return an expanded document in which only the named parameters have a range.

    The others lose the key `range` and keep their value. Raises SpecError, with all problems, if a
    name is unknown (a similar name is suggested) or its parameter has no range or no value.
    """
    problems = Problems()
    for name in names:
        parameter = automaton.parameters.get(name)
        if parameter is None:
            label = f"`{automaton.name}` has no parameter `{name}`"
            fittable = [one.name for one in automaton.parameters.values() if _can_be_fitted(one)]
            hint = suggest_name(name, automaton.parameters)
            hint = hint or f"parameters that can be fitted: {', '.join(fittable) or 'none'}"
            asked = Source("command line", (name,))
            problems.error("name", Span(asked, 1, 1, max(1, len(name))), label, hint)
        elif not _can_be_fitted(parameter):
            label = f"`{name}` has no range to be fitted in"
            problems.error("range", parameter.span, label, "`range: [low, high]` beside its value")
    problems.raise_if_errors()
    root = document.root
    for name in automaton.parameters:
        table = _parameter_table(root, name)
        if name not in names and table is not None and "range" in table.entries:
            rest = {key: entry for key, entry in table.entries.items() if key != "range"}
            root = put_node(root, ("parameters", name), MappingNode(rest, table.span))
    return dataclasses.replace(document, root=root)


def _can_be_fitted(parameter: Parameter) -> bool:
    """Return whether a parameter has a range and a value."""
    return parameter.range is not None and parameter.value is not None


def _parameter_table(root: MappingNode, name: str) -> MappingNode | None:
    """Return the table of a parameter in a document, or None."""
    section = root.get("parameters")
    node = section.get(name) if isinstance(section, MappingNode) else None
    return node if isinstance(node, MappingNode) else None


def _fitted_parameters(
    automaton: Automaton,
    estimate: Estimate,
    stds: Mapping[str, float],
    correlations: Mapping[tuple[str, str], float],
) -> tuple[FittedParameter, ...]:
    """Return the fitted parameters of an estimate in its order, with standard deviations [SI]."""
    strongest: dict[str, tuple[str, float]] = {}
    for (first, second), together in correlations.items():
        strongest.setdefault(first, (second, together))
        strongest.setdefault(second, (first, together))
    values, fitted = estimate.values(0), []
    for one in estimate.candidate.free_parameters:
        if one.per_recording:
            continue
        declared = automaton.parameters[one.name].value
        assert declared is not None
        quantity = Quantity(values[one.name], one.unit, stds[one.name])
        left, note = prior_std_ratio(quantity, one), parameter_note(quantity, one)
        pair = strongest.get(one.name)
        fitted.append(FittedParameter(one.name, float(declared), quantity, left, note, pair))
    return tuple(fitted)


def parameter_note(fitted_value: Quantity, coordinate: FreeParameter) -> str:
    """Return a remark on a fitted parameter: at a bound, not determined by the data, or "".

    It is at a bound if its distance from an end is below `BOUND_TOLERANCE` (0.1 %) of the range,
    which comes first, and not determined if `prior_std_ratio` exceeds `UNDETERMINED_RATIO` (0.8) or
    is NaN.
    """
    width = BOUND_TOLERANCE * (coordinate.high - coordinate.low)
    if min(fitted_value.value - coordinate.low, coordinate.high - fitted_value.value) < width:
        return "at the end of its range"
    if not prior_std_ratio(fitted_value, coordinate) <= UNDETERMINED_RATIO:
        return "these data do not determine it"
    return ""


def prior_std_ratio(fitted_value: Quantity, coordinate: FreeParameter) -> float:
    """Return the standard deviation of a fitted parameter over that of its prior.

    For a logarithmic coordinate the prior's is scaled by the fitted value. The result is 1 if the
    prior's standard deviation is 0.
    """
    slope = coordinate.prior_std * (fitted_value.value if coordinate.is_log else 1.0)
    return fitted_value.std / abs(slope) if slope else 1.0
