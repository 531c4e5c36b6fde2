"""Verify what a diagnosis writes: each effect at each place, checked, run, and the same in C.

Into docs/evidence/diagnosis.json.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from functools import partial
from pathlib import Path

from diagnosis.model.placed_effect import PlacedEffect
from language.overlays.expand_document import Project
from language.text.diagnostic import SpecError
from tests.diagnosis.example_report import acceptable_layers
from tests.diagnosis.run_variant import run_variant
from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=1, help="only each n-th of them")
    every: int = parser.parse_args().every
    os.chdir(ROOT)
    return measure_figures(
        "diagnosis", {"variants_in_lockstep": partial(variants_in_lockstep, every)}
    )


def variants_in_lockstep(every: int = 1) -> Figure:
    """Accept each effect of the library at each place of the base, and run what is written."""
    layers = acceptable_layers(Project(ROOT))[::every]
    faults = {layer.id: fault for layer in layers if (fault := _fault(layer))}
    effects = sorted({layer.effect.name for layer in layers})
    return {"met": not faults, "effects": len(effects), "variants": len(layers), "faults": faults}


def _fault(layer: PlacedEffect) -> str:
    """Return what is wrong with a variant; empty where nothing is."""
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        try:
            found = run_variant(Path(name), [layer])
        except SpecError as error:
            return str(error)
    return "" if found.is_whole else str(found)


if __name__ == "__main__":
    raise SystemExit(main())
