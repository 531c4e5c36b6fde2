"""Answer: what a diagnosis said of a case beside what is true of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import fmean
from typing import Any

NOTHING = "nothing_missing"
BASE = ("J_em", "k", "c", "alpha", "J_v")
"""Parameters of the base that are compared with their true values."""


@dataclass(frozen=True)
class Answer:
    """A label and a verdict (empty where there is none), and the CPU time [s] that it took, that of
    the C compiler counted.

    `simpler` is what each simpler method names.
    """

    case: str
    plan: str
    label: Mapping[str, Any]
    verdict: Mapping[str, Any]
    cpu_s: float
    simpler: Mapping[str, str] = field(default_factory=dict)
    compiler_s: float = 0.0

    @property
    def ids(self) -> tuple[str, ...]:
        """The true effects."""
        return tuple(one["id"] for one in self.label["effects"])

    @property
    def true(self) -> str:
        """The true effects in one word; `none` for a clean case."""
        return "+".join(self.ids) or "none"

    @property
    def named(self) -> tuple[str, ...]:
        """The effects that the verdict names; none where it is not `effect`."""
        return tuple(one["id"] for one in self.verdict.get("effects", ()))

    @property
    def said(self) -> str:
        """The first effect that is named, or what the verdict says where there is none."""
        return self.named[0] if self.named else str(self.verdict.get("verdict", "failed"))

    @property
    def stated(self) -> frozenset[str]:
        """All effects of the stated set: those named, and those that may be it as well."""
        others = (one["id"] for one in self.verdict.get("ambiguous_with", ()))
        return frozenset((*self.named, *others))

    @property
    def is_named(self) -> bool:
        """Whether the first name is that of a true effect."""
        return bool(self.named) and self.named[0] in self.ids

    @property
    def is_stated(self) -> bool:
        """Whether a true effect is in the stated set."""
        return bool(self.stated & set(self.ids))

    @property
    def is_alarm(self) -> bool:
        """Whether more is said than that nothing is missing."""
        return self.said != NOTHING

    def is_placed(self, first: int = 1) -> bool:
        """Tell whether a true place is among the `first` ones of the verdict."""
        places = self.verdict.get("location", {}).get("places", ())[:first]
        return any(one["place"] in places for one in self.label["effects"])

    @property
    def probability(self) -> float | None:
        """The probability of the first name; None where nothing is named."""
        for one in self.verdict.get("candidates", ()) if self.named else ():
            if one["id"] == self.named[0]:
                return float(one["probability"])
        return None

    def misfit(self, when: str) -> float | None:
        """Return the held-out NRMSE `before` or `after`, averaged over the signals."""
        shown: Mapping[str, Any] = self.verdict.get("fit", {}).get("held_out", {})
        values = [one[f"nrmse_{when}"] for one in shown.values()]
        return fmean(values) if values and None not in values else None

    @property
    def base_errors(self) -> Sequence[float]:
        """How far the parameters of the repaired base are off, as parts of their true values."""
        found = self.verdict.get("base", {})
        return [
            abs(found[name]["after"]["value"] / self.label["base"][name] - 1.0)
            for name in BASE
            if name in found
        ]
