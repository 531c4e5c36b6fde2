"""modewright: hybrid automata in YAML, interpreted, printed as C, kept in lock-step.

What is named here is loaded when it is first used: `import modewright` itself takes no time.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from diagnosis.dossier import DiagnosisReport
    from diagnosis.fit import Fit
    from engine.results.plot import Picture
    from engine.results.run_comparison import RunDifference
    from engine.results.trajectory import Event, Trajectory
    from language.text.diagnostic import Problem, SpecError, render_all
    from lockstep.comparison import Verdict
    from modewright.api import Loaded, Replayed, check, load, lockstep, replay, simulate
    from modewright.calibrations import (
        CalibrationPage,
        ImportedPage,
        ResolvedPage,
        export_calibration,
        import_calibration,
        resolve_calibration,
    )
    from modewright.code import a2l, dbc, fmu, fuzz, generate, mcdc, metrics, prove
    from modewright.diagnoses import diagnose, fit, save_diagnosis
    from modewright.diagram import Diagram, graph
    from modewright.recordings import CheckedRecordings, check_recordings
    from modewright.runs import compare, plot, read, save
    from modewright.studies import (
        sensitivity,
        study_pictures,
        study_report,
        study_summary,
        sweep,
    )
    from modewright.tests import run_tests
    from modewright.traces import trace

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
    "CalibrationPage": "modewright.calibrations",
    "ImportedPage": "modewright.calibrations",
    "ResolvedPage": "modewright.calibrations",
    "export_calibration": "modewright.calibrations",
    "import_calibration": "modewright.calibrations",
    "resolve_calibration": "modewright.calibrations",
    "CheckedRecordings": "modewright.recordings",
    "Diagram": "modewright.diagram",
    "DiagnosisReport": "diagnosis.dossier",
    "Event": "engine.results.trajectory",
    "Fit": "diagnosis.fit",
    "Picture": "engine.results.plot",
    "Problem": "language.text.diagnostic",
    "RunDifference": "engine.results.run_comparison",
    "SpecError": "language.text.diagnostic",
    "Trajectory": "engine.results.trajectory",
    "Verdict": "lockstep.comparison",
    "a2l": "modewright.code",
    "dbc": "modewright.code",
    "fmu": "modewright.code",
    "fuzz": "modewright.code",
    "generate": "modewright.code",
    "mcdc": "modewright.code",
    "metrics": "modewright.code",
    "prove": "modewright.code",
    "compare": "modewright.runs",
    "plot": "modewright.runs",
    "read": "modewright.runs",
    "check": "modewright.checking",
    "check_recordings": "modewright.recordings",
    "diagnose": "modewright.diagnoses",
    "fit": "modewright.diagnoses",
    "graph": "modewright.diagram",
    "render_all": "language.text.diagnostic",
    "save": "modewright.runs",
    "save_diagnosis": "modewright.diagnoses",
    "run_tests": "modewright.tests",
    "sensitivity": "modewright.studies",
    "study_pictures": "modewright.studies",
    "study_report": "modewright.studies",
    "study_summary": "modewright.studies",
    "sweep": "modewright.studies",
    "trace": "modewright.traces",
}
"""Where a name of the public API is defined, if not in `modewright.api`."""


def __getattr__(name: str) -> Any:
    """Load a name of the public API."""
    if name not in __all__:
        raise AttributeError(f"module `modewright` has no `{name}`")
    value = getattr(import_module(PLACES.get(name, "modewright.api")), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
