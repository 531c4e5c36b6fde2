"""Declarations: the data classes of parameters, inputs, states and their formulas."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Literal

from language.expressions.syntax_tree import SyntaxTree, names
from language.expressions.units import Unit
from language.text.diagnostic import Span
from language.typecheck.lookup_table import LookupTable
from language.typecheck.types import TypeName

Range = tuple[Fraction, Fraction]
"""Lower and upper bound in SI."""

ParameterKind = Literal["fixed", "tunable", "derived"]


@dataclass(frozen=True)
class Formula:
    """An expression with the key path at which it is written.

    `is_integer` tells that the type of its value is `int`.
    """

    tree: SyntaxTree
    key: str
    is_integer: bool = False

    @cached_property
    def reads(self) -> tuple[str, ...]:
        """The names and paths in the expression, from left to right, with repetitions."""
        return tuple(name.path for name in names(self.tree))

    @property
    def span(self) -> Span:
        """The place of the expression in its file."""
        return self.tree.span


@dataclass(frozen=True)
class Fitting:
    """The settings of a parameter for a fit to recordings; values are in SI.

    `neutral` is the value at which the effect of the parameter vanishes, or `absent` if there is no
    such value. `plain` is the value at which the effect reduces to a simpler one. `starts` are
    start values of the fit. With `per: recording` each recording has a value of its own. With
    `form: order` a fit starts from the strongest periods over the path that is the first state of
    the effect.
    """

    neutral: Fraction | Literal["absent"] | None = None
    starts: tuple[Fraction, ...] = ()
    per: Literal["model", "recording"] = "model"
    form: Literal["constant", "constant_or_random_walk", "order"] = "constant"
    plain: Fraction | None = None


@dataclass(frozen=True)
class Parameter:
    """A parameter with an exact value in SI or, if derived, an expression of other parameters.

    The value of a `bool` is 0 or 1, the value of an `enum` the index in `values`. A parameter with
    a `table` has neither value nor expression.
    """

    name: str
    kind: ParameterKind
    unit: Unit
    value: Fraction | None
    derived: Formula | None
    range: Range | None
    key: str
    span: Span
    fitting: Fitting = Fitting()
    type: TypeName = "real"
    values: tuple[str, ...] = ()
    table: LookupTable | None = None
    about: str = ""


@dataclass(frozen=True)
class RangePolicy:
    """The reaction to a value outside its range (rule 18), and the fault bit that it sets.

    `fallback` (a value in SI, or `hold`) replaces a value that is not finite.
    """

    on_range: Literal["saturate", "hold", "fault"] = "saturate"
    fallback: Fraction | Literal["hold"] | None = None
    fault: str | None = None


@dataclass(frozen=True)
class Input:
    """An input of an automaton; `values` are the literals of an `enum`."""

    name: str
    unit: Unit
    type: TypeName
    default: Fraction | None
    range: Range | None
    key: str
    span: Span
    values: tuple[str, ...] = ()
    range_policy: RangePolicy = RangePolicy()
    about: str = ""

    @property
    def is_bool(self) -> bool:
        """Whether the type of the input is `bool`."""
        return self.type == "bool"


@dataclass(frozen=True)
class State:
    """A continuous state, or a variable that a sampled automaton retains from tick to tick."""

    name: str
    unit: Unit
    initial: Formula
    range: Range | None
    key: str
    span: Span
    type: TypeName = "real"
    values: tuple[str, ...] = ()
    range_policy: RangePolicy = RangePolicy()
    about: str = ""


MICRO_STEP_LIMIT_FAULT = "micro_step_limit"
"""The fault bit of a tick that reaches the bound of micro-steps (rule 7)."""

BUILTIN_FAULTS = ("event_limit", MICRO_STEP_LIMIT_FAULT, "rewind_limit", "stale_calibration")
"""The fault bits that the product sets itself; a spec must not declare them."""
