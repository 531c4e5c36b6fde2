"""Cases: what a generator has written for a plan, in one folder, and its labels in another."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from tests.validation.blind_study.plan import Plan
from tests.validation.evidence.evidence_store import ROOT

GENERATOR = "tests.generators.blind_cases"
Label = Mapping[str, Any]


@dataclass(frozen=True)
class Cases:
    """Folders of recordings by name; `labels` is where what is true of them is kept."""

    folder: Path
    labels: Path

    @property
    def seal(self) -> str:
        """The SHA-256 of the labels."""
        return hashlib.sha256(self.labels.read_bytes()).hexdigest()

    def known(self, most: int | None = None) -> dict[str, Label]:
        """Return the labels by case, at most so many: their order is drawn by the generator."""
        every = json.loads(self.labels.read_text())["cases"]
        return dict(islice(every.items(), most))


def generate_cases(plan: Plan, seed: int, generator: str = GENERATOR) -> Cases:
    """Return the cases of a plan; they are written if they are not there."""
    key = f"{plan.effects} {plan.strength} {seed}".encode()
    name = f"{generator.rpartition('.')[2]}_{seed}_{hashlib.sha256(key).hexdigest()[:10]}"
    folder = ROOT / "build" / "proof" / "recordings" / name
    labels = ROOT / "build" / "proof" / "labels" / f"{name}.json"
    if not labels.exists():
        shutil.rmtree(folder, ignore_errors=True)
        asked = {
            "--out": folder,
            "--labels": labels,
            "--seed": seed,
            "--effects": plan.effects,
            "--strength": plan.strength,
            "--jobs": 2,
        }
        words = [str(word) for pair in asked.items() for word in pair]
        print(f"{plan.name}: writing the cases of seed {seed} ...", flush=True)
        subprocess.run(
            [sys.executable, "-m", generator, *words],
            cwd=ROOT,
            check=True,
            stdout=subprocess.DEVNULL,
        )
    return Cases(folder, labels)
