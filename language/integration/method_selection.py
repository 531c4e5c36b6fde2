"""Selection of the integration method of a field by name, with its stability limits (rule 17d)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from itertools import product

from language.integration.crossing_location import IntegrationMethod
from language.integration.euler import euler_method
from language.integration.exponential import ExponentialContext, exact_method, exponential_method
from language.integration.midpoint import midpoint_method
from language.integration.rk4 import rk4_method
from language.integration.stability_limit import check_stability, stability_limit_of
from language.integration.vector_field import VectorField
from language.ir.number_type import round_to_type
from language.ir.ops import Assign, Block
from language.ir.program import IntegrationInfo, StabilityLimit
from language.ir.round_literals import round_block
from language.lowering.constants import derive_block
from language.lowering.linearisation import LinearisationPoint
from language.lowering.program_parameters import tunables_of
from language.model.automaton import Automaton
from language.model.declaration import Formula
from language.numerics.affine_form import affine_forms
from language.numerics.evaluate import Scalar, evaluate
from language.text.diagnostic import Problems, Span

RUNGE_KUTTA_METHODS: Mapping[str, Callable[[VectorField], IntegrationMethod]] = {
    "euler": euler_method,
    "midpoint": midpoint_method,
    "rk4": rk4_method,
}
"""The methods without solved constants, by their name in the spec."""
EXPONENTIAL_METHODS: Mapping[
    str, Callable[[VectorField, ExponentialContext, Span, Problems], IntegrationMethod]
] = {
    "exponential": exponential_method,
    "exact": exact_method,
}
"""The methods with solved constants, by their name in the spec."""
MAX_CORNER_PARAMETERS = 10
"""The largest number of tunable parameters whose range ends are combined.

2^10 matrices per mode take about a second.
"""


def build_method(
    name: str,
    field: VectorField,
    blocks: Mapping[str, Block],
    point: LinearisationPoint,
    step_size: Fraction,
    span: Span,
    problems: Problems,
) -> tuple[IntegrationMethod, IntegrationInfo]:
    """Return the integration method `name` for a field, and its description for reports.

    `blocks` are those of the field and `step_size` is in s. Reported as errors at `span` are a step
    above the stability limit of a mode, `exact` with an input that varies inside a step, and, for
    exponential methods, more than MAX_CORNER_PARAMETERS tunable parameters (the first ones are
    used) and what the method itself reports. Raises KeyError for an unknown name.
    """
    step = float(step_size)
    number = point.automaton.numbers
    rates = {m: round_block(blocks[f"rates_{m}"], number) for m in field.automaton.modes}
    depends_on = tunables_of(point.automaton, _flow_formulas(field))
    if name in EXPONENTIAL_METHODS and len(depends_on) > MAX_CORNER_PARAMETERS:
        label = (
            f"a method with solved numbers takes at most {MAX_CORNER_PARAMETERS} tunable parameters"
        )
        problems.error("method", span, label, f"these enter: {', '.join(depends_on)}")
        depends_on = depends_on[:MAX_CORNER_PARAMETERS]
    if name == "exact" and field.is_time_dependent:
        label = "`exact` holds the inputs over a step; one of them changes inside it"
        problems.error("method", span, label, "`exponential` takes them at the middle")
    corners = tuple(_calibration_corners(point, depends_on)) if name in EXPONENTIAL_METHODS else ()
    solved = ExponentialContext(point, corners, step_size, rates, depends_on, number)
    limits = []
    for mode in field.automaton.modes:
        parts = affine_forms(rates[mode], field.states, point.constant_values)
        limit = stability_limit_of(field, mode, parts, name)
        if limit:
            check_stability(limit, name, step, span, problems)
            value = limit.eigenvalue
            limits.append(StabilityLimit(mode, limit.step, value, limit.term, limit.state))
    method = (
        RUNGE_KUTTA_METHODS[name](field)
        if name in RUNGE_KUTTA_METHODS
        else EXPONENTIAL_METHODS[name](field, solved, span, problems)
    )
    return method, IntegrationInfo(
        name, step, method.terms, dict(method.step_norms), tuple(limits), len(field.states)
    )


def _flow_formulas(field: VectorField) -> list[Formula]:
    """Return the equations and both sides of the balances of all modes."""
    found: list[Formula] = []
    for mode in field.automaton.all_modes:
        found += mode.equations.values()
        for balance in mode.flow.values():
            found += [Formula(balance.left, ""), Formula(balance.right, "")]
    return found


def _calibration_corners(
    point: LinearisationPoint, tunables: tuple[str, ...]
) -> Iterator[Mapping[str, Scalar]]:
    """Yield the constants at each combination of the range ends of some tunable parameters.

    Parameters without a range keep their value; without any range nothing is yielded. Derived
    parameters are recomputed.
    """
    automaton: Automaton = point.automaton
    limits = {name: automaton.parameters[name].range for name in tunables}
    ranged = {name: limit for name, limit in limits.items() if limit}
    for ends in product(*ranged.values()) if ranged else ():
        values = dict(point.constant_values)
        for name, end in zip(ranged, ends, strict=True):
            values[f"calibration.{name}"] = round_to_type(end)
        for op in derive_block(automaton):
            assert isinstance(op, Assign)
            values[op.target] = evaluate(op.value, values)
        yield values
