"""Cases: the recordings that a generator has written for a group, and their labels elsewhere."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from math import ceil
from pathlib import Path
from typing import Any

from tests.validation.evidence.evidence_store import ROOT
from tests.validation.study.generator_table import Generator, Group

FOLDER = ROOT / "build" / "validation"
Label = Mapping[str, Any]


@dataclass(frozen=True)
class Cases:
    """Folders of recordings by name; `labels` is the file with what is true of them."""

    folder: Path
    labels: Path

    @property
    def digest(self) -> str:
        """The SHA-256 of the labels."""
        return hashlib.sha256(self.labels.read_bytes()).hexdigest()

    def known(self, share: float = 1.0) -> dict[str, Label]:
        """Return the labels by case, those of the first ones for a share of all.

        The generator draws the order of the cases.
        """
        every: dict[str, Label] = json.loads(self.labels.read_text())["cases"]
        return dict(islice(every.items(), ceil(share * len(every))))


def generate_cases(generator: Generator, group: Group) -> Cases:
    """Return the cases of a group; they are written if they are not there."""
    key = f"{group.effects} {group.strength} {group.seed}".encode()
    name = f"{generator.name}_{group.seed}_{hashlib.sha256(key).hexdigest()[:10]}"
    cases = Cases(FOLDER / "recordings" / name, FOLDER / "labels" / f"{name}.json")
    if not cases.labels.exists():
        shutil.rmtree(cases.folder, ignore_errors=True)
        options = {
            "--out": cases.folder,
            "--labels": cases.labels,
            "--seed": group.seed,
            "--effects": group.effects,
            "--strength": group.strength,
            "--jobs": 2,
        }
        words = [str(word) for pair in options.items() for word in pair]
        print(f"{group.key}: writing the cases of seed {group.seed} ...", flush=True)
        cases.labels.parent.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, "-m", generator.package, *words]
        subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return cases
