"""Sampling reader: read the section `sampling` of a study."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate

from language.readers.base_reader import Reader
from language.text.document import ScalarNode, YamlNode
from sweep.definition.study import (
    MORRIS_LEVELS,
    Distribution,
    Sampling,
    SweepVariable,
    design_group_size,
)

METHODS = ("random", "latin_hypercube", "sobol", "saltelli", "morris")
"""The methods that draw random points."""
MAX_POINTS = 10_000_000
"""Largest number of variants of a study: a quarter of an hour at 10 000 per second, 2 GB of
results.
"""
MAX_SEED = 2**31 - 1
"""Largest seed of a study."""


class SamplingReader(Reader):
    """Reader of the sampling; it reports contradictions to the section `vary`."""

    def sampling(self, node: YamlNode | None, varied: Sequence[SweepVariable]) -> Sampling:
        """Return the sampling of a section for the given variables.

        Without a section, or with the word `grid` or `one_at_a_time`, nothing is drawn; a random
        variable is then an error. Otherwise the section names one of METHODS with a number; the
        count of a design (saltelli, morris) is that number of blocks or paths times their points.
        Errors are reported; warns if a Sobol sequence is unbalanced or a Morris design cannot reach
        a value of a choice.
        """
        drawn = [each for each in varied if each.is_random]
        if node is None or isinstance(node, ScalarNode):
            return self._grid_sampling(node, drawn)
        problem_count = len(self.problems.reported)
        table = self.read_mapping(node, "sampling", (*METHODS, "seed"))
        methods = [key for key in table.entries if key in METHODS]
        if len(methods) != 1:
            label = f"`sampling` has one of {', '.join(METHODS)}"
            if len(self.problems.reported) == problem_count:
                self.problems.error("form", node.span, label, "like `{sobol: 256, seed: 1}`")
            return Sampling()
        method = methods[0]
        place = table.entries[method]
        count = self.read_integer(place.node, method, 1, 1, MAX_POINTS)
        if not drawn and not self.problems.has_errors:
            label = "nothing in `vary` is drawn: `sampling` has no work"
            self.problems.error("form", place.span, label, "`replicates` repeats with other noise")
        unbalanced = find_imbalance(method, count)
        if unbalanced:
            self.problems.warning("sampling", place.node.span, *unbalanced)
        for each in drawn if method == "morris" else ():
            self._warn_unreached_choices(each)
        seed = self.read_integer(table.get("seed"), "seed", 0, 0, MAX_SEED)
        count *= design_group_size(method, len(drawn))
        return Sampling(method, count, seed)  # type: ignore[arg-type]

    def _warn_unreached_choices(self, variable: SweepVariable) -> None:
        """Warn if the levels of Morris paths never draw some values of a choice."""
        course = variable.distribution
        if not isinstance(course, Distribution) or course.shape != "choice":
            return
        ends = list(accumulate(course.weights or [1.0] * len(course.numbers)))
        levels = [(k + 0.5) / MORRIS_LEVELS * ends[-1] for k in range(MORRIS_LEVELS)]
        reached = {bisect_right(ends[:-1], level) for level in levels}
        missed = len(course.numbers) - len(reached)
        if missed:
            words = "1 value" if missed == 1 else f"{missed} values"
            label = (
                f"paths of Morris draw {words} of `{variable.name}` never: "
                f"{MORRIS_LEVELS} levels see shares of {1 / MORRIS_LEVELS:g} each"
            )
            hint = "weights that are more alike, or `saltelli`"
            self.problems.warning("sampling", variable.span, label, hint)

    def _grid_sampling(self, node: YamlNode | None, drawn: Sequence[SweepVariable]) -> Sampling:
        """Return a full grid or one-at-a-time sampling.

        Reports random variables, which need a count.
        """
        word = self.read_choice(node, "sampling", ("grid", "one_at_a_time"), "grid")
        if drawn:
            first = drawn[0]
            label = f"`{first.name}` is drawn, and `sampling` does not say how many points"
            hint = "like `sampling: {random: 200, seed: 1}`"
            self.problems.error("missing", first.span, label, hint)
        return Sampling(one_at_a_time=word == "one_at_a_time")


def find_imbalance(method: str, count: int) -> tuple[str, str] | None:
    """Return a message and a hint if `count` is no power of 2 for `sobol` or `saltelli`.

    Returns None otherwise. The hint names the power of 2 that is nearest in the logarithm.
    """
    if method not in ("sobol", "saltelli") or not count & (count - 1):
        return None
    label = f"{count} is no power of 2: a Sobol sequence loses its balance"
    return label, f"like {1 << round(math.log2(count))}"
