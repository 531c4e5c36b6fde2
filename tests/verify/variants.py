"""Verify what a diagnosis writes: each effect at each place, checked, run, and the same in C.

Into docs/evidence/diagnosis.json.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from functools import partial
from pathlib import Path

from diagnosis.layers import Layer
from language.problem import SpecError
from language.project import Project
from tests.diagnosis.accepting import acceptable
from tests.diagnosis.variant_run import variant_run
from tests.verify.store import ROOT, Figure, measured


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=1, help="only each n-th of them")
    every: int = parser.parse_args().every
    os.chdir(ROOT)
    return measured("diagnosis", {"variants_in_lockstep": partial(variants_in_lockstep, every)})


def variants_in_lockstep(every: int = 1) -> Figure:
    """Accept each effect of the library at each place of the base, and run what is written."""
    layers = acceptable(Project(ROOT))[::every]
    faults = {layer.id: fault for layer in layers if (fault := _fault(layer))}
    effects = sorted({layer.effect.name for layer in layers})
    return {"met": not faults, "effects": len(effects), "variants": len(layers), "faults": faults}


def _fault(layer: Layer) -> str:
    """Return what is wrong with a variant; empty where nothing is."""
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        try:
            found = variant_run(Path(name), [layer])
        except SpecError as error:
            return str(error)
    return "" if found.is_whole else str(found)


if __name__ == "__main__":
    raise SystemExit(main())
