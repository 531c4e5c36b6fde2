"""Verify diagnosis on the open generator: names, places, false alarms, CPU seconds.

Cases are made from a seed, each is diagnosed in a process of its own (see open_case); what was
diagnosed with the same code is not diagnosed again.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import islice
from pathlib import Path
from statistics import median
from typing import Any

from tests.generators.open_cases.__main__ import main as generate
from tests.validation.evidence.evidence_store import (
    CODE,
    ROOT,
    Figure,
    code_digest,
    measure_figures,
)

SEED = 20261201
EFFECTS = "all:5,none:65"
NAMED, ALARMS, PLACED, CPU = 0.92, 0.05, 0.85, 10.0
"""Bars: first names, false alarms, places, CPU seconds of the median case."""
Result = Mapping[str, Any]


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--effects", default=EFFECTS)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--first", type=int, help="diagnose so many cases only")
    given = parser.parse_args()
    rates = {
        "open_generator": partial(
            open_generator, given.seed, given.effects, given.jobs, given.first
        )
    }
    return measure_figures("diagnosis", rates)


def open_generator(seed: int, effects: str, jobs: int, first: int | None = None) -> Figure:
    """Return the rates of all cases of a seed, or of the `first` ones."""
    folder = ROOT / "build" / "open_cases"
    cases = folder / f"{seed}_{effects.replace(':', '-')}"
    labels = cases.with_suffix(".json")
    if not labels.exists():
        generate(
            [
                "--out",
                str(cases),
                "--labels",
                str(labels),
                "--seed",
                str(seed),
                "--effects",
                effects,
            ]
        )
    every: Mapping[str, Any] = json.loads(labels.read_text())["cases"]
    known = dict(islice(every.items(), first))
    results = folder / code_digest((*CODE, "diagnosis"))[:16]
    results.mkdir(parents=True, exist_ok=True)

    def diagnosed(name: str) -> Result | None:
        path = results / f"{cases.name}_{name}.json"
        if not path.exists():
            command = [
                sys.executable,
                "-m",
                "tests.validation.diagnosis_evidence.single_case",
                cases / name,
                path,
            ]
            done = subprocess.run(list(map(str, command)), cwd=ROOT, capture_output=True, text=True)
            print(_line(name, known[name], path, done.stderr), flush=True)
        return json.loads(path.read_text()) if path.exists() else None

    with ThreadPoolExecutor(jobs) as pool:
        found = dict(zip(known, pool.map(diagnosed, known), strict=True))
    return {**rates(known, found), "seed": seed, "cases": effects}


def rates(labels: Mapping[str, Any], found: Mapping[str, Result | None]) -> Figure:
    """Return first names, false alarms and places of results, by effect where they are wrong."""
    wrong: dict[str, list[str]] = {}
    named = placed = alarms = 0
    effects = [name for name, label in labels.items() if label["effects"]]
    for name, label in labels.items():
        verdict = (found[name] or {}).get("verdict", {})
        first = first_name(verdict)
        if not label["effects"]:
            alarms += verdict.get("verdict") != "nothing_missing"
            if verdict.get("verdict") != "nothing_missing":
                wrong.setdefault("none", []).append(first)
            continue
        true = label["effects"][0]
        is_named = first == true["id"]
        named += is_named
        placed += true["place"] in verdict.get("location", {}).get("places", [])[:1]
        if not is_named:
            wrong.setdefault(true["id"], []).append(first)
    clean = len(labels) - len(effects)
    seconds = [result["cpu_s"] for result in found.values() if result]
    cpu = median(seconds) if seconds else 0.0
    figure = {
        "named": named / max(len(effects), 1),
        "placed": placed / max(len(effects), 1),
        "alarms": alarms / max(clean, 1),
        "cpu_s": round(cpu, 2),
    }
    met = figure["named"] >= NAMED and figure["placed"] >= PLACED and figure["alarms"] <= ALARMS
    counts = {
        "of_effects": len(effects),
        "of_clean": clean,
        "failed": list(found.values()).count(None),
    }
    return {"met": met and cpu <= CPU, **figure, **counts, "wrong": wrong}


def first_name(verdict: Mapping[str, Any]) -> str:
    """Return the first effect of a verdict, or what it says where there is none."""
    effects: Sequence[Mapping[str, Any]] = verdict.get("effects", [])
    return str(effects[0]["id"]) if effects else str(verdict.get("verdict", "failed"))


def _line(name: str, label: Mapping[str, Any], path: Path, errors: str) -> str:
    true = "+".join(one["id"] for one in label["effects"]) or "none"
    if not path.exists():
        return f"{name} {true}: failed: {errors.strip().splitlines()[-1:]}"
    result = json.loads(path.read_text())
    said = first_name(result["verdict"])
    return f"{name} {label['rate_Hz']} Hz {true}: {said}, {result['cpu_s']:.1f} CPU s"


if __name__ == "__main__":
    sys.exit(main())
