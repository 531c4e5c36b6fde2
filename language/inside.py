"""Inside: the files that a spec names stay in its project (docs/decisions/0005)."""

from __future__ import annotations

import os
from pathlib import Path

from language.problem import Problems, Span, SpecError

ALLOW_OUTSIDE_ENV = "MODEWRIGHT_ALLOW_OUTSIDE"
"""Environment variable that lets specs name any file; `--allow-outside` sets it."""
RECORDINGS_ENV = "MODEWRIGHT_RECORDINGS"
"""Environment variable that names the folder of recordings, wherever it is."""


def path_exists(path: Path) -> bool:
    """Tell whether there is something at a path; no path is too long or too odd to be asked for."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def project_root_of(file: Path) -> Path:
    """Return the nearest folder above a file that has a `spec/`, else the file's own folder."""
    parents = file.resolve().parents
    return next((parent for parent in parents if (parent / "spec").is_dir()), parents[0])


def require_inside_project(path: Path, span: Span, root: Path) -> None:
    """Raise SpecError for a file that a spec names outside of its project; links are followed."""
    named_in = Path(span.source.name)
    if os.environ.get(ALLOW_OUTSIDE_ENV) or not path_exists(path) or not path_exists(named_in):
        return
    from importlib import resources  # not for the help of the command line

    roots = [root, project_root_of(named_in), Path(str(resources.files("spec")))]
    if os.environ.get(RECORDINGS_ENV):
        roots.append(Path(os.environ[RECORDINGS_ENV]))
    resolved = path.resolve()
    if any(resolved.is_relative_to(allowed.resolve()) for allowed in roots):
        return
    problems = Problems()
    label = "this file is outside of the project"
    hint = f"its root is {project_root_of(named_in)}; `modewright --allow-outside ...` reads it nevertheless"
    problems.error("outside", span, label, hint)
    raise SpecError(problems.reported)
