"""Verify random specs: 200 specs, 1000 steps, 2 number types, no differing bit; what they exercise.

Resumable; docs/evidence/random_specs.json holds every part.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path

from language.ir.number_type import NUMBER_TYPES
from tests.lockstep.random_specs.combined_executable import Batch
from tests.lockstep.random_specs.coverage_requirements import Quality, measure_quality
from tests.lockstep.random_specs.engine_run import record_ticks
from tests.lockstep.random_specs.spec import program
from tests.lockstep.random_specs.spec_kinds import spec_of
from tests.validation.evidence.evidence_store import Figure
from tests.validation.evidence.random_spec_chunks import Programs, verify_parts

SPECS, TICKS = 200, 1000


def main() -> int:
    """Run the parts that are missing; return 0 if every figure is met."""
    return report(*verify_parts(__doc__, "specs", SPECS, programs, part))


def programs(numbers: range, folder: Path) -> Programs:
    """Return some random specs with their Programs in both number types."""
    return [(s, program(s, n, folder)) for s in map(spec_of, numbers) for n in NUMBER_TYPES]


def part(pairs: Programs, folder: Path) -> Figure:
    """Return what some specs give: bits by number type, and what they exercise in float64."""
    batch, quality = Batch([made for _, made in pairs], folder / "batch"), Quality()
    bits: dict[str, Counter[str]] = {number: Counter() for number in NUMBER_TYPES}
    for spec, made in pairs:
        if made.number_type == "float64":
            tape, one = measure_quality(spec, made, TICKS)
            quality.add(one)
        else:
            tape = record_ticks(spec, made, TICKS)
        verdict = batch.verdict(tape)
        if verdict.first:
            print(f"{made.name}: {verdict.first}")
        values = {"values": verdict.values, "differing": verdict.differing}
        values |= {"transitions": verdict.transitions, "steps": verdict.ticks}
        bits[made.number_type].update({"specs": 1, **values})
    kept = {"specs": quality.specs, "shares": quality.shares, "hits": quality.hits}
    counted = {number: dict(counts) for number, counts in bits.items()}
    return {"ticks": TICKS, "bits": counted, **kept}


def report(parts: list[Figure], least: int) -> int:
    """Print every figure; return 0 if all are met."""
    quality = Quality()
    for one in parts:
        quality.add(Quality(one["specs"], Counter(one["shares"]), Counter(one["hits"])))
    print(quality.table())
    fine = sum(one["specs"] for one in parts) > 0
    for number in NUMBER_TYPES:
        total: Counter[str] = Counter()
        for one in parts:
            total.update({"differing": 0, **one["bits"][number]})
        met = total["differing"] == 0 and total["steps"] == total["specs"] * TICKS
        fine = fine and met
        print(f"{'met ' if met else 'OPEN'} random specs, {number}: {json.dumps(total)}")
    lacking = quality.missing_coverage(least)
    said = f"each rule, operation, function and input hit {least} times"
    print(f"{'OPEN' if lacking else 'met '} {said}: {lacking or 'all'}")
    return 0 if fine and not lacking else 1


if __name__ == "__main__":
    sys.exit(main())
