"""Sampling reader: the section `sampling` of a study."""

from __future__ import annotations

import math
from collections.abc import Sequence

from language.document import Node, Scalar
from language.reader import Reader
from sweep.study import Sampling, Varied, points_each

METHODS = ("random", "latin_hypercube", "sobol", "saltelli", "morris")
MOST_POINTS = 10_000_000
"""Most variants of a study: at 10 000 per second a quarter of an hour, 2 GB of results."""
LARGEST_SEED = 2**31 - 1


class SamplingReader(Reader):
    """How points are drawn; what contradicts `vary` is reported."""

    def sampling(self, node: Node | None, varied: Sequence[Varied]) -> Sampling:
        """Return what the section says of what varies."""
        drawn = [each for each in varied if each.is_drawn]
        if node is None or isinstance(node, Scalar):
            return self._no_draw(node, drawn)
        told = len(self.problems.found)
        table = self.table(node, "sampling", (*METHODS, "seed"))
        methods = [key for key in table.entries if key in METHODS]
        if len(methods) != 1:
            label = f"`sampling` has one of {', '.join(METHODS)}"
            if len(self.problems.found) == told:
                self.problems.error("form", node.span, label, "like `{sobol: 256, seed: 1}`")
            return Sampling()
        method = methods[0]
        place = table.entries[method]
        count = self.whole(place.node, method, 1, 1, MOST_POINTS)
        if not drawn and not self.problems.has_errors:
            label = "nothing in `vary` is drawn: `sampling` has no work"
            self.problems.error("form", place.span, label, "`replicates` repeats with other noise")
        unbalanced = balance_fault(method, count)
        if unbalanced:
            self.problems.warning("sampling", place.node.span, *unbalanced)
        seed = self.whole(table.get("seed"), "seed", 0, 0, LARGEST_SEED)
        count *= points_each(method, len(drawn))
        return Sampling(method, count, seed)  # type: ignore[arg-type]

    def _no_draw(self, node: Node | None, drawn: Sequence[Varied]) -> Sampling:
        word = self.choice(node, "sampling", ("grid", "one_at_a_time"), "grid")
        if drawn:
            first = drawn[0]
            label = f"`{first.name}` is drawn, and `sampling` does not say how many points"
            hint = "like `sampling: {random: 200, seed: 1}`"
            self.problems.error("missing", first.span, label, hint)
        return Sampling(one_at_a_time=word == "one_at_a_time")


def balance_fault(method: str, count: int) -> tuple[str, str] | None:
    """Return what is wrong with a number of points of a sequence, and what helps; None: nothing."""
    if method not in ("sobol", "saltelli") or not count & (count - 1):
        return None
    label = f"{count} is no power of 2: a Sobol sequence loses its balance"
    return label, f"like {1 << round(math.log2(count))}"
