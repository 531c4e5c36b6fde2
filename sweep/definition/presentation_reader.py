"""Presentation reader: read the sections `summary` and `plots` of a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, suggest_name
from language.text.document import Entry, ScalarNode, YamlNode
from sweep.definition.measure import Measure, columns_of
from sweep.definition.study import (
    MAX_CONFIDENCE,
    MIN_CONFIDENCE,
    Axis,
    Presentation,
    SweepVariable,
)

PLOT_OPTIONS: dict[str, tuple[str, ...]] = {
    "heat_map": ("over", "by"),
    "parallel": (),
    "tornado": (),
    "histogram": ("by",),
}
"""The kinds of plots with their options: axes (`over`) and grouping (`by`)."""


class PresentationReader(Reader):
    """Reader of summary and plots; `by` may name a column with few values only."""

    def __init__(
        self,
        problems: Problems,
        varied: Sequence[SweepVariable],
        measures: Sequence[Measure],
    ) -> None:
        """Store the names of the variables and measures to which the sections may refer."""
        super().__init__(problems)
        self.groups = ["variant", "scenario", *(v.name for v in varied if not v.is_random)]
        self.groups += [v.name for v in varied if getattr(v.distribution, "shape", "") == "choice"]
        self.axes = [v.name for v in varied if isinstance(v.distribution, Axis)]
        self.varied = [v.name for v in varied]
        columns = [column for measure in measures for column in columns_of(measure)]
        self.columns = [column.name for column in columns]
        self.numbers = [column.name for column in columns if column.type != "list"]
        self.example = self.numbers[0] if self.numbers else "late"

    def presentation(self, summary: YamlNode | None, plots: YamlNode | None) -> Presentation:
        """Return the presentation of the sections `summary` and `plots`; either may be None.

        The default confidence is 0.95. Reports unknown names, a confidence outside MIN_CONFIDENCE
        to MAX_CONFIDENCE, and plots of the wrong form; these are in the result nevertheless.
        """
        table = self.read_mapping(summary, "summary", ("by", "confidence"))
        by = self._names(table.get("by"), "by", self.groups, True)
        confidence = 0.95
        node = table.get("confidence")
        if node is not None:
            confidence = float(self.read_quantity(node, "confidence", node.span, None)[0])
            if not MIN_CONFIDENCE <= confidence <= MAX_CONFIDENCE:
                limits = f"from {MIN_CONFIDENCE:g} to {MAX_CONFIDENCE!r}"
                label = f"`confidence` is a share {limits}, like 0.95"
                self.problems.error("range", node.span, label)
        found = {entry.key: self._plot(entry) for entry in self.named_entries(plots, "plots")}
        return Presentation(tuple(by), confidence, found)

    def _plot(self, entry: Entry) -> dict[str, Any]:
        """Return the options of one plot: `kind`, `of` and, by kind, `over` and `by`.

        Return an empty dict if its kind is missing or ambiguous.
        """
        problem_count = len(self.problems.reported)
        options = {key for keys in PLOT_OPTIONS.values() for key in keys}
        table = self.read_mapping(entry.node, f"plots.{entry.key}", (*PLOT_OPTIONS, *options))
        kinds = [key for key in table.entries if key in PLOT_OPTIONS]
        if len(kinds) != 1:
            if len(self.problems.reported) == problem_count:
                label = f"`{entry.key}` is one picture"
                self.problems.error("form", entry.span, label, f"one of {', '.join(PLOT_OPTIONS)}")
            return {}
        kind = kinds[0]
        own = self.read_mapping(table, kind, (kind, *PLOT_OPTIONS[kind]))
        node = own.get(kind)
        allows_many = kind == "parallel" and not isinstance(node, ScalarNode)
        of = self._names(
            node, kind, self.columns if kind == "histogram" else self.numbers, not allows_many
        )
        if kind != "parallel" and len(of) != 1 and len(self.problems.reported) == problem_count:
            label = f"a `{kind}` is of one measure"
            self.problems.error("form", entry.span, label, f"like `{{{kind}: {self.example}}}`")
        found: dict[str, Any] = {"kind": kind, "of": of}
        if kind == "heat_map":
            found["over"] = self._names(own.get("over"), "over", self.varied)
            if len(found["over"]) != 2:
                label = "a heat map is `over: [x, y]`, two things that vary"
                self.problems.error("form", entry.span, label)
        if own.get("by"):
            found["by"] = self._names(own.get("by"), "by", self.groups, True)
        return found

    def _names(
        self, node: YamlNode | None, what: str, known: Sequence[str], is_single: bool = False
    ) -> list[str]:
        """Return the names in a list, or in a scalar if `is_single`.

        Reports names that are not known.
        """
        items: list[ScalarNode] = []
        if is_single and isinstance(node, ScalarNode):
            items = [node]
        elif node is not None:
            items = self.read_list(node, what)
        for item in items:
            if item.text not in known:
                label = f"`{item.text}` is not one of {', '.join(known) or 'nothing'}"
                self.problems.error("choice", item.span, label, suggest_name(item.text, known))
        return [item.text for item in items]
