"""Declaration: what an automaton declares - parameters, tables, inputs, states, and formulas."""

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

ParameterKind = Literal["fixed", "tunable", "derived"]


@dataclass(frozen=True)
class Formula:
    """An expression and the key path that it stands under; `whole`: its value is whole."""

    tree: SyntaxTree
    key: str
    is_integer: bool = False

    @cached_property
    def reads(self) -> tuple[str, ...]:
        """The names that the expression reads, from left to right."""
        return tuple(name.path for name in names(self.tree))

    @property
    def span(self) -> Span:
        """The place of the expression."""
        return self.tree.span


@dataclass(frozen=True)
class Fitting:
    """What a fit needs to know of a parameter (SI).

    `neutral` is the value at which the effect that brought it vanishes, `absent` where there is
    none, `plain` the value at which it is a plainer one than its name says; `starts` are values to
    start from; `per` is `recording` for one value each.
    """

    neutral: Fraction | Literal["absent"] | None = None
    starts: tuple[Fraction, ...] = ()
    per: Literal["model", "recording"] = "model"
    form: Literal["constant", "constant_or_random_walk"] = "constant"
    plain: Fraction | None = None


@dataclass(frozen=True)
class Parameter:
    """A value in SI (exact) or, if derived, an expression of other parameters.

    The value of a `bool` is 0 or 1, that of an `enum` the place in `values`.
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
    """What becomes of a value outside its range (rule 18), and the fault bit that it sets.

    `fallback` (a value in SI, or `hold`) is for a value that is not finite.
    """

    on_range: Literal["saturate", "hold", "fault"] = "saturate"
    fallback: Fraction | Literal["hold"] | None = None
    fault: str | None = None


@dataclass(frozen=True)
class Input:
    """A value from outside; `values` are those of an `enum`."""

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
        """Tell whether it is true or false."""
        return self.type == "bool"


@dataclass(frozen=True)
class State:
    """A continuous variable, or what a sampled automaton carries from tick to tick."""

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

BUILTIN_FAULTS = ("event_limit", MICRO_STEP_LIMIT_FAULT, "rewind_limit", "stale_calibration")
"""Faults that the product names itself."""
