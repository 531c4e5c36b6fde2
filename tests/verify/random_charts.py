"""Verify random charts: 300 charts, 500 ticks, no differing bit; what they exercise.

Charts nest three deep, with two regions in a mode, history, events and waits; every second one is
in float32. Resumable like random_specs.py; docs/evidence/random_charts.json holds every part.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from language.number import NUMBERS
from lockstep.compare import judged
from tests.lockstep.chance.batch import Batch
from tests.lockstep.chance.chart_hits import KINDS, ChartHits, automaton_again
from tests.lockstep.chance.charts import chart_of
from tests.lockstep.chance.running import taped
from tests.lockstep.chance.spec import program
from tests.verify.random_specs import Programs, key_of

ROOT = Path(__file__).resolve().parent.parent.parent
EVIDENCE = ROOT / "docs" / "evidence" / "random_charts.json"
CHARTS, TICKS, PART = 300, 500, 20
HITS = 20
"""Least number of times that all charts together do each thing."""
MOVING, OF_ALL = 3, 0.8
"""Transitions that a chart takes at least, and how many charts do."""


def main() -> int:
    """Run the parts that are missing; return 0 if every figure is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--charts", type=int, default=CHARTS)
    charts: int = parser.parse_args().charts
    os.chdir(ROOT)
    found: dict[str, Any] = json.loads(EVIDENCE.read_text()) if EVIDENCE.exists() else {}
    for start in range(0, charts, PART):
        with tempfile.TemporaryDirectory() as folder:
            pairs = programs(range(start, min(charts, start + PART)), Path(folder))
            key = key_of(pairs)
            if found.get(str(start), {}).get("digest") == key:
                continue
            found[str(start)] = {"digest": key, "ticks": TICKS, **part(pairs, Path(folder))}
        EVIDENCE.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n")
        print(f"charts {start} to {start + PART - 1}: {found[str(start)]['bits']}", flush=True)
    least = -(-HITS * charts // CHARTS)
    return report([found[str(start)] for start in range(0, charts, PART)], least)


def programs(numbers: range, folder: Path) -> Programs:
    """Return some random charts with their Programs, in both number types by turns."""
    charts = [(number, chart_of(number)) for number in numbers]
    return [(spec, program(spec, NUMBERS[k % 2], folder)) for k, spec in charts]


def part(pairs: Programs, folder: Path, ticks: int = TICKS) -> dict[str, Any]:
    """Return what some charts give: bits, how many of them move, and what they do."""
    batch = Batch([made for _, made in pairs], folder / "batch")
    bits: Counter[str] = Counter()
    hits: Counter[str] = Counter()
    for spec, made in pairs:
        watch = ChartHits(automaton_again(spec, folder), made)
        tape = taped(spec, made, ticks, look=watch.look)
        verdict = judged(tape, batch.run(made, b"".join(tape.inputs)))
        if verdict.first:
            print(f"{made.name}: {verdict.first}")
        bits.update({"charts": 1, "values": verdict.values, "differing": verdict.differing})
        bits.update({"transitions": verdict.transitions, "ticks": verdict.ticks})
        bits.update({"moving": int(verdict.transitions >= MOVING)})
        hits.update(watch.counts)
    return {"bits": dict(bits), "hits": {name: hits[name] for name in KINDS}}


def lacking(bits: dict[str, int], hits: dict[str, int], least: int) -> list[str]:
    """Return what charts do less often than asked, in words."""
    found = [f"{name}: {hits[name]} < {least}" for name in KINDS if hits[name] < least]
    if bits["moving"] < OF_ALL * bits["charts"]:
        found.append(f"at least {MOVING} transitions: {bits['moving']} of {bits['charts']}")
    return found


def report(parts: list[dict[str, Any]], least: int) -> int:
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
