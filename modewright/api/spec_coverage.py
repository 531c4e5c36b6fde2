"""Test coverage: present the coverage of specs as text, as JSON and in the diagram of modes."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from expectation.coverage_measurement import (
    Coverage,
    measure_coverage,
    merge_coverages,
    names_of,
)
from expectation.mcdc import COVERED, Decision
from language.text.arguments import PathText, to_project, to_text
from language.text.diagnostic import Problem, Source, Span, SpecError
from modewright.api.spec_tests import find_tests, load_tests
from modewright.diagram.diagram import Diagram, graph
from modewright.diagram.diagram_elements import Arrow, ModeBox, ModePath, RegionBox, Shade


def coverage_lines(coverage: Coverage) -> Iterator[str]:
    """Yield the lines of a coverage report: the counts, then what is not covered.

    The first line is `name: 3 of 4 modes, ... (MC/DC)`; each line about a missed item is indented
    by two blanks.
    """
    counts = coverage.count()
    counts_text = ", ".join(f"{done} of {total} {what}" for what, (done, total) in counts.items())
    yield f"{coverage.name}: {counts_text} (MC/DC)"
    yield from (f"  {line}" for line in coverage.list_missed())


def coverage_json(coverage: Coverage) -> dict[str, Any]:
    """Return the coverage of an automaton as a dict for JSON.

    The keys are automaton, file, counts (reached and of), modes (key, entered) and transitions
    (key, taken, outcomes, conditions).
    """
    return {
        "automaton": coverage.name,
        "file": coverage.automaton.span.source.name,
        "counts": {
            what: {"reached": done, "of": total} for what, (done, total) in coverage.count().items()
        },
        "modes": [{"key": key, "entered": key in coverage.modes} for key in coverage.all_modes],
        "transitions": [_transition_json(coverage, decision) for decision in coverage.decisions],
    }


def coverage_diagram(coverage: Coverage, root: PathText | None = None) -> Diagram:
    """Return the diagram of the covered automaton, read again from its file, shaded by coverage.

    Raises SpecError.
    """
    return shade_diagram(graph(coverage.automaton.span.source.name, root), coverage)


def project_coverage_diagram(reference: PathText, root: PathText | None = None) -> Diagram:
    """Return the diagram of an automaton shaded by the coverage of the project's tests.

    The tests whose system has an instance of the automaton are run on the engine and their
    coverages merged. Raises SpecError, also if there is no such test.
    """
    diagram = graph(reference, root)
    file = to_project(root).path_of(to_text(reference, "reference"))
    tests = load_tests(find_tests(root, [file]), root)
    names = [{each.automaton.name for each in t.system.instances.values()} for t in tests]
    used = [test for test, own in zip(tests, names, strict=True) if diagram.name in own]
    parts = [part for test in used for part in measure_coverage(test) if part.name == diagram.name]
    if not parts:
        label = f"no test of the project runs `{diagram.name}`"
        raise SpecError(
            [Problem("missing", Span(Source("spec"), 1, 1), label, "see docs/testing.md")]
        )
    return shade_diagram(diagram, merge_coverages(parts)[0])


def shade_diagram(diagram: Diagram, coverage: Coverage) -> Diagram:
    """Return a diagram whose modes and transitions are shaded by a coverage.

    A mode is `covered` if it was entered, else `missed`. A transition is `missed` if it was never
    taken, `part` if a condition is not covered by MC/DC, else `covered`; its label gets a line `?
    condition` for each such condition. Arrows without a decision in the coverage do not change.
    """
    entered = {names_of(key) for key in coverage.modes}
    decisions = {names_of(decision.key): decision for decision in coverage.decisions}
    return dataclasses.replace(
        diagram,
        regions=tuple(_shade_region(region, entered) for region in diagram.regions),
        arrows=tuple(_shade_arrow(arrow, coverage, decisions) for arrow in diagram.arrows),
    )


def _shade_region(region: RegionBox, entered: set[ModePath]) -> RegionBox:
    """Return a region whose modes are shaded."""
    return dataclasses.replace(
        region, modes=tuple(_shade_mode(mode, entered) for mode in region.modes)
    )


def _shade_mode(mode: ModeBox, entered: set[ModePath]) -> ModeBox:
    """Return a mode and its inner modes, shaded as entered or not."""
    is_entered = mode.path in entered
    inner = tuple(_shade_region(region, entered) for region in mode.regions)
    return dataclasses.replace(mode, shade="covered" if is_entered else "missed", regions=inner)


def _shade_arrow(arrow: Arrow, coverage: Coverage, decisions: dict[ModePath, Decision]) -> Arrow:
    """Return a transition shaded as missed, partly or fully covered.

    Conditions that are not covered are added.
    """
    decision = decisions.get((*arrow.source, arrow.name))
    if decision is None:
        return arrow
    shade: Shade = "missed"
    lines = arrow.lines
    if decision.key in coverage.transitions:
        shown = zip(decision.conditions, coverage.condition_coverage(decision), strict=True)
        unshown = [text for text, how in shown if how not in COVERED]
        shade = "part" if unshown else "covered"
        lines = (*lines, *(f"? {text}" for text in unshown))
    return dataclasses.replace(arrow, shade=shade, lines=lines)


def _transition_json(coverage: Coverage, decision: Decision) -> dict[str, Any]:
    """Return the coverage of one transition as a dict for JSON."""
    seen = coverage.combinations.get(decision.key, frozenset())
    return {
        "key": decision.key,
        "taken": decision.key in coverage.transitions,
        "outcomes": sorted(decision.outcomes(seen)),
        "conditions": [
            {"text": text, "shown": how}
            for text, how in zip(
                decision.conditions, coverage.condition_coverage(decision), strict=True
            )
        ],
    }
