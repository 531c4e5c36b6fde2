"""Verify random specs: 200 specs, 1000 steps, 2 number types, no differing bit; what they exercise.

Resumable: a part whose Programs, C and engine are the same is not run again;
docs/evidence/random_specs.json holds every part.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from codegen.source import c_files
from language.number import NUMBERS
from language.printing import digest
from language.program import Program
from lockstep.compare import judged
from tests.lockstep.chance.batch import Batch
from tests.lockstep.chance.kinds import chance
from tests.lockstep.chance.quality import Quality, measured
from tests.lockstep.chance.running import taped
from tests.lockstep.chance.spec import Spec, program

ROOT = Path(__file__).resolve().parent.parent.parent
EVIDENCE = ROOT / "docs" / "evidence" / "random_specs.json"
SPECS, TICKS, PART = 200, 1000, 20
HITS = 20
"""Least number of times that all specs hit each rule, operation, function and kind of input."""
Programs = list[tuple[Spec, Program]]


def main() -> int:
    """Run the parts that are missing; return 0 if every figure is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--specs", type=int, default=SPECS)
    specs: int = parser.parse_args().specs
    os.chdir(ROOT)
    found: dict[str, Any] = json.loads(EVIDENCE.read_text()) if EVIDENCE.exists() else {}
    for start in range(0, specs, PART):
        with tempfile.TemporaryDirectory() as folder:
            pairs = programs(range(start, min(specs, start + PART)), Path(folder))
            key = key_of(pairs)
            if found.get(str(start), {}).get("digest") == key:
                continue
            found[str(start)] = {"digest": key, "ticks": TICKS, **part(pairs, Path(folder))}
        EVIDENCE.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n")
        print(f"specs {start} to {start + PART - 1}: {found[str(start)]['bits']}", flush=True)
    least = -(-HITS * specs // SPECS)
    return report([found[str(start)] for start in range(0, specs, PART)], least)


def key_of(pairs: Programs) -> str:
    """Return the digest of what runs: the Programs, their C, the engine."""
    total = hashlib.sha256()
    for path in sorted((ROOT / "engine").glob("*.py")):
        total.update(path.read_bytes())
    for _, made in pairs:
        total.update("".join((digest(made), *c_files(made).values())).encode())
    return total.hexdigest()


def programs(numbers: range, folder: Path) -> Programs:
    """Return some random specs with their Programs in both number types."""
    return [(s, program(s, n, folder)) for s in map(chance, numbers) for n in NUMBERS]


def part(pairs: Programs, folder: Path) -> dict[str, Any]:
    """Return what some specs give: bits by number type, and what they exercise in float64."""
    batch, quality = Batch([made for _, made in pairs], folder / "batch"), Quality()
    bits: dict[str, Counter[str]] = {number: Counter() for number in NUMBERS}
    for spec, made in pairs:
        if made.number == "float64":
            tape, one = measured(spec, made, TICKS)
            quality.add(one)
        else:
            tape = taped(spec, made, TICKS)
        verdict = judged(tape, batch.run(made, b"".join(tape.inputs)))
        if verdict.first:
            print(f"{made.name}: {verdict.first}")
        values = {"values": verdict.values, "differing": verdict.differing}
        values |= {"transitions": verdict.transitions, "steps": verdict.ticks}
        bits[made.number].update({"specs": 1, **values})
    kept = {"specs": quality.specs, "shares": quality.shares, "hits": quality.hits}
    return {"bits": {number: dict(counts) for number, counts in bits.items()}, **kept}


def report(parts: list[dict[str, Any]], least: int) -> int:
    """Print every figure; return 0 if all are met."""
    quality = Quality()
    for one in parts:
        quality.add(Quality(one["specs"], Counter(one["shares"]), Counter(one["hits"])))
    print(quality.table())
    fine = sum(one["specs"] for one in parts) > 0
    for number in NUMBERS:
        total: Counter[str] = Counter()
        for one in parts:
            total.update({"differing": 0, **one["bits"][number]})
        met = total["differing"] == 0 and total["steps"] == total["specs"] * TICKS
        fine = fine and met
        print(f"{'met ' if met else 'OPEN'} random specs, {number}: {json.dumps(total)}")
    lacking = quality.lacking(least)
    said = f"each rule, operation, function and input hit {least} times"
    print(f"{'OPEN' if lacking else 'met '} {said}: {lacking or 'all'}")
    return 0 if fine and not lacking else 1


if __name__ == "__main__":
    sys.exit(main())
