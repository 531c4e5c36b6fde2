"""modewright: simulate, check, diagnose and generate C from hybrid automata in YAML.

The public API. A name is imported at its first use, so that `import modewright` is fast.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from diagnosis.pipeline.parameter_fit import Fit
    from diagnosis.report.diagnosis_report import DiagnosisReport
    from engine.results.plot import Picture
    from engine.results.run_comparison import RunDifference
    from engine.results.sampled_run import Event
    from engine.results.trajectory import Trajectory
    from language.text.diagnostic import Problem, SpecError, render_all
    from lockstep.comparison import Verdict
    from modewright.api.calibrations import (
        CalibrationPage,
        ImportedPage,
        ResolvedPage,
        export_calibration,
        import_calibration,
        resolve_calibration,
    )
    from modewright.api.code_generation import a2l, dbc, fmu, fuzz, generate, mcdc, metrics, prove
    from modewright.api.diagnosis import diagnose, fit, save_diagnosis
    from modewright.api.recordings import CheckedRecordings, check_recordings
    from modewright.api.runs import compare, plot, read, save
    from modewright.api.simulation import Loaded, Replayed, load, lockstep, replay, simulate
    from modewright.api.spec_check import check
    from modewright.api.spec_tests import run_tests
    from modewright.api.studies import sensitivity, study_pictures, study_summary, sweep
    from modewright.api.traceability import trace
    from modewright.diagram.diagram import Diagram, graph
    from modewright.render.study_page import study_report

if not os.path.isdir(os.path.dirname(__file__)):
    # Specs, C sources and templates are read as files, also by compilers and worker processes.
    raise ImportError(
        "modewright needs to be installed; it cannot run from a zip archive", name=__name__
    )

__all__ = [
    "CalibrationPage",
    "CheckedRecordings",
    "DiagnosisReport",
    "Diagram",
    "Event",
    "Fit",
    "ImportedPage",
    "Loaded",
    "Picture",
    "Problem",
    "Replayed",
    "ResolvedPage",
    "RunDifference",
    "SpecError",
    "Trajectory",
    "Verdict",
    "a2l",
    "check",
    "check_recordings",
    "compare",
    "dbc",
    "diagnose",
    "export_calibration",
    "fit",
    "fmu",
    "fuzz",
    "generate",
    "graph",
    "import_calibration",
    "load",
    "lockstep",
    "mcdc",
    "metrics",
    "plot",
    "prove",
    "read",
    "render_all",
    "replay",
    "resolve_calibration",
    "run_tests",
    "save",
    "save_diagnosis",
    "sensitivity",
    "simulate",
    "study_pictures",
    "study_report",
    "study_summary",
    "sweep",
    "trace",
]

PLACES = {
    "CalibrationPage": "modewright.api.calibrations",
    "ImportedPage": "modewright.api.calibrations",
    "ResolvedPage": "modewright.api.calibrations",
    "export_calibration": "modewright.api.calibrations",
    "import_calibration": "modewright.api.calibrations",
    "resolve_calibration": "modewright.api.calibrations",
    "CheckedRecordings": "modewright.api.recordings",
    "Diagram": "modewright.diagram.diagram",
    "DiagnosisReport": "diagnosis.report.diagnosis_report",
    "Event": "engine.results.trajectory",
    "Fit": "diagnosis.pipeline.parameter_fit",
    "Picture": "engine.results.plot",
    "Problem": "language.text.diagnostic",
    "RunDifference": "engine.results.run_comparison",
    "SpecError": "language.text.diagnostic",
    "Trajectory": "engine.results.trajectory",
    "Verdict": "lockstep.comparison",
    "a2l": "modewright.api.code_generation",
    "dbc": "modewright.api.code_generation",
    "fmu": "modewright.api.code_generation",
    "fuzz": "modewright.api.code_generation",
    "generate": "modewright.api.code_generation",
    "mcdc": "modewright.api.code_generation",
    "metrics": "modewright.api.code_generation",
    "prove": "modewright.api.code_generation",
    "compare": "modewright.api.runs",
    "plot": "modewright.api.runs",
    "read": "modewright.api.runs",
    "check": "modewright.api.spec_check",
    "check_recordings": "modewright.api.recordings",
    "diagnose": "modewright.api.diagnosis",
    "fit": "modewright.api.diagnosis",
    "graph": "modewright.diagram.diagram",
    "render_all": "language.text.diagnostic",
    "save": "modewright.api.runs",
    "save_diagnosis": "modewright.api.diagnosis",
    "run_tests": "modewright.api.spec_tests",
    "sensitivity": "modewright.api.studies",
    "study_pictures": "modewright.api.studies",
    "study_report": "modewright.render.study_page",
    "study_summary": "modewright.api.studies",
    "sweep": "modewright.api.studies",
    "trace": "modewright.api.traceability",
}
"""The module of each public name; names that are absent are in `modewright.api.simulation`."""


def __getattr__(name: str) -> Any:
    """Import a public name (one in `__all__`) at its first use and store it in this module.

    The module of the name is in PLACES, else `modewright.api.simulation`. Raises AttributeError for
    other names.
    """
    if name not in __all__:
        raise AttributeError(f"module `modewright` has no `{name}`")
    value = getattr(import_module(PLACES.get(name, "modewright.api.simulation")), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
