"""Variant run: a variant as a diagnosis writes it, checked, simulated and compared with its C."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import modewright as mw
from diagnosis.estimation.covariance import quantities_of
from diagnosis.model.placed_effect import PlacedEffect
from diagnosis.report.variant_file import format_variant, variant_name
from language.overlays.expand_document import Project
from tests.diagnosis.example_report import BASE, make_dossier

NAME = variant_name(BASE)
RUN = f"""language: 1
scenario: tip_out
of: {NAME}
horizon: 0.2 s
initial: {{w_s: 8 rad/s}}
inputs:
  T_em: {{start: 60 N*m, steps: {{0.05 s: -60 N*m, 0.15 s: 90 N*m}}}}
  T_br: {{start: 0 N*m, steps: {{0.1 s: 300 N*m}}}}
record: {{every: 5 ms}}
"""
ROUNDED = 1e-5
"""What is written has six digits."""


@dataclass(frozen=True)
class VariantRun:
    """What became of a variant; `moves`: its speeds are finite and change; `off` is the largest
    relative difference of what is written to what was found.
    """

    problems: list[str]
    ticks: int
    is_equal: bool
    moves: bool
    off: float

    @property
    def is_whole(self) -> bool:
        """Tell whether it is a spec like any other, and the same in C."""
        return not self.problems and self.is_equal and self.moves and self.off < ROUNDED


def run_variant(folder: Path, layers: Sequence[PlacedEffect]) -> VariantRun:
    """Write the variant in which layers were accepted below a folder, and run it.

    Raises SpecError, RunError.
    """
    (folder / "spec").mkdir(exist_ok=True)
    dossier = make_dossier(Project(folder), layers)
    (folder / "spec" / "variant.yaml").write_text(format_variant(dossier, BASE), "utf-8")
    (folder / "spec" / "tip_out.yaml").write_text(RUN, "utf-8")
    written = mw.load(NAME, "tip_out", root=folder).system.instances[NAME].automaton.parameters
    assert dossier.diagnosis
    found = quantities_of(dossier.diagnosis.selection.model)
    off = [abs(float(written[n].value or 0) - q.value) / abs(q.value) for n, q in found.items()]
    problems = [problem.label for problem in mw.check(NAME, root=folder)]
    trajectory, verdicts = mw.lockstep(NAME, "tip_out", root=folder)
    speeds = [trajectory.signals[f"{NAME}.{name}"] for name in ("w_em", "w_s")]
    moves = all(bool(np.isfinite(one).all() and np.ptp(one) > 0.0) for one in speeds)
    equal = trajectory.stopped is None and all(one.is_equal for one in verdicts)
    return VariantRun(problems, min(one.ticks for one in verdicts), equal, moves, max(off))
