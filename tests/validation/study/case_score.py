"""Score of a case: what a diagnosis says, beside what is true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from statistics import fmean
from typing import Any

from tests.validation.study.accepted_names import relatives_of, right_names

NOTHING = "nothing_missing"
SURE = 0.9
"""Probability from which a name counts as certain."""
MIN_VISIBILITY = 1.0
"""RMS difference to the twin without effects over the noise, after a refit of the base, from which
an effect counts as visible."""
MAX_RATIO = 1.01
"""Ratio of the misfits after and before a diagnosis above which a model is worse."""


@dataclass(frozen=True)
class Answer:
    """A label and a verdict (empty where there is none), with the CPU time [s], that of the C
    compiler included.

    `decision` has the numbers of the decision, `simpler` is what each simpler method names.
    """

    generator: str
    group: str
    case: str
    label: Mapping[str, Any]
    verdict: Mapping[str, Any]
    cpu_s: float
    decision: Mapping[str, Any] = field(default_factory=dict)
    simpler: Mapping[str, str] = field(default_factory=dict)
    message: str = ""

    @property
    def ids(self) -> tuple[str, ...]:
        """The true effects."""
        return tuple(one["id"] for one in self.label["effects"])

    @property
    def true(self) -> str:
        """The true effects in one word; `none` for a clean case."""
        return "+".join(self.ids) or "none"

    @property
    def is_visible(self) -> bool:
        """Whether the recordings show the effect; True if the label does not tell."""
        known = self.label.get("visibility")
        return not known or max(one["refit"] for one in known.values()) >= MIN_VISIBILITY

    def right(self, is_strict: bool = False) -> frozenset[str]:
        """Return the names that count as right."""
        names = (right_names(self.generator, one, is_strict) for one in self.ids)
        return frozenset().union(*names)

    @property
    def named(self) -> tuple[str, ...]:
        """The effects that the verdict names; none where it is not `effect`."""
        return tuple(one["id"] for one in self.verdict.get("effects", ()))

    @property
    def said(self) -> str:
        """The first effect that is named, or the outcome where there is none."""
        return self.named[0] if self.named else str(self.verdict.get("verdict", "no verdict"))

    @property
    def first(self) -> str:
        """The first name: of the named effects, or of the set of an ambiguous verdict."""
        is_set = self.verdict.get("verdict") == "ambiguous"
        return next(iter(self.named or (self.stated if is_set else ())), "")

    @property
    def stated(self) -> tuple[str, ...]:
        """All effects of the stated set: those named, then those that may be it as well."""
        others = (one["id"] for one in self.verdict.get("ambiguous_with", ()))
        return tuple(dict.fromkeys((*self.named, *others)))

    def is_named(self, is_strict: bool = False) -> bool:
        """Return whether the first name is right."""
        return self.first in self.right(is_strict)

    def is_alone_named(self, is_strict: bool = False) -> bool:
        """Return whether the first name is right and the verdict does not leave it open."""
        return self.is_named(is_strict) and self.said != "ambiguous"

    def is_stated(self, is_strict: bool = False) -> bool:
        """Return whether a right name is in the stated set."""
        return bool(self.right(is_strict) & set(self.stated))

    def are_all_named(self, is_strict: bool = False) -> bool:
        """Return whether the verdict names each effect."""
        names = (right_names(self.generator, one, is_strict) for one in self.ids)
        return all(one & set(self.named) for one in names)

    @property
    def is_alarm(self) -> bool:
        """Whether the verdict is not that nothing is missing."""
        return self.said != NOTHING

    @property
    def is_placed(self) -> bool:
        """Whether the first place of the verdict is a true one."""
        places = self.verdict.get("location", {}).get("places", ())[:1]
        return any(one["place"] in places for one in self.label["effects"])

    def is_unknown(self, is_strict: bool = False) -> bool:
        """Return whether the verdict is right if the effect is not in the library.

        It is `unknown` at the right place, or (not if `is_strict`) a nearest relative there whose
        probability is below `SURE` (0.9).
        """
        if not self.is_placed:
            return False
        if self.said == "unknown":
            return True
        is_near = self.stated[:1] and self.stated[0] in relatives_of(self.right())
        return not is_strict and bool(is_near) and (self.probability or 0.0) < SURE

    @property
    def probability(self) -> float | None:
        """The probability of the first name of the stated set; None without one."""
        first = [*self.verdict.get("effects", ()), *self.verdict.get("ambiguous_with", ())][:1]
        for one in self.verdict.get("candidates", ()):
            if first and (one["id"], one["place"]) == (first[0]["id"], first[0]["place"]):
                return float(one["probability"])
        return None

    def misfit(self, when: str) -> float | None:
        """Return the held-out NRMSE `before` or `after`, the mean over the signals."""
        shown: Mapping[str, Any] = self.verdict.get("fit", {}).get("held_out", {})
        values = [one[f"nrmse_{when}"] for one in shown.values()]
        return fmean(values) if values and None not in values else None

    @property
    def removed_misfit(self) -> float:
        """The part of the held-out NRMSE that the diagnosis removes; 0 without simulations.

        It is 1 if only the simulation after the diagnosis stays finite, and -1 if only the one
        before does.
        """
        before, after = self.misfit("before"), self.misfit("after")
        if before is None or after is None:
            return float(after is not None) - float(before is not None)
        return 1.0 - after / before if before else 0.0

    @property
    def is_worse(self) -> bool:
        """Whether the held-out NRMSE is larger after the diagnosis than before."""
        return self.removed_misfit < 1.0 - MAX_RATIO
