"""Verify random charts: 300 charts, 500 ticks, no differing bit; what they exercise.

Charts nest three deep, with two regions in a mode, history, events and waits; every second one is
in float32. Resumable; docs/evidence/random_charts.json holds every part.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path

from language.ir.number_type import NUMBER_TYPES
from tests.lockstep.random_specs.chart_rule_coverage import KINDS, ChartHits, reload_automaton
from tests.lockstep.random_specs.charts import chart_of
from tests.lockstep.random_specs.combined_executable import Batch
from tests.lockstep.random_specs.engine_run import record_ticks
from tests.lockstep.random_specs.spec import program
from tests.validation.evidence.evidence_store import Figure
from tests.validation.evidence.random_spec_chunks import Programs, verify_parts

CHARTS, TICKS = 300, 500
MOVING, OF_ALL = 3, 0.8
"""Transitions that a chart takes at least, and how many charts do."""


def main() -> int:
    """Run the parts that are missing; return 0 if every figure is met."""
    return report(*verify_parts(__doc__, "charts", CHARTS, programs, measure_part))


def programs(numbers: range, folder: Path) -> Programs:
    """Return some random charts with their Programs, in both number types by turns."""
    charts = [(number, chart_of(number)) for number in numbers]
    return [(spec, program(spec, NUMBER_TYPES[k % 2], folder)) for k, spec in charts]


def measure_part(pairs: Programs, folder: Path, ticks: int = TICKS) -> Figure:
    """Return what some charts give: bits, how many of them move, and what they do."""
    batch = Batch([made for _, made in pairs], folder / "batch")
    bits: Counter[str] = Counter()
    hits: Counter[str] = Counter()
    for spec, made in pairs:
        watch = ChartHits(reload_automaton(spec, folder), made)
        tape = record_ticks(spec, made, ticks, look=watch.observe)
        verdict = batch.verdict(tape)
        if verdict.first:
            print(f"{made.name}: {verdict.first}")
        bits.update({"charts": 1, "values": verdict.values, "differing": verdict.differing})
        bits.update({"transitions": verdict.transitions, "ticks": verdict.ticks})
        bits.update({"moving": int(verdict.transitions >= MOVING)})
        hits.update(watch.counts)
    return {"ticks": ticks, "bits": dict(bits), "hits": {name: hits[name] for name in KINDS}}


def lacking(bits: dict[str, int], hits: dict[str, int], least: int) -> list[str]:
    """Return what charts do less often than asked, in words."""
    found = [f"{name}: {hits[name]} < {least}" for name in KINDS if hits[name] < least]
    if bits["moving"] < OF_ALL * bits["charts"]:
        found.append(f"at least {MOVING} transitions: {bits['moving']} of {bits['charts']}")
    return found


def report(parts: list[Figure], least: int) -> int:
    """Print every figure; return 0 if all are met."""
    bits: Counter[str] = Counter()
    hits: Counter[str] = Counter()
    for one in parts:
        bits.update(one["bits"])
        hits.update(one["hits"])
    for name in KINDS:
        print(f"{name:48} {hits[name]}")
    fine = bits["differing"] == 0 and bits["ticks"] == bits["charts"] * TICKS
    print(f"{'met ' if fine else 'OPEN'} random charts: {json.dumps(bits)}")
    found = lacking(bits, hits, least)
    print(f"{'OPEN' if found else 'met '} each of these {least} times: {found or 'all'}")
    return 0 if fine and not found else 1


if __name__ == "__main__":
    sys.exit(main())
