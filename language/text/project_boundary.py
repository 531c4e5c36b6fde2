"""The boundary of a project: which files outside of it a spec may name."""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path

from language.text.diagnostic import Problems, Span, SpecError

ALLOW_OUTSIDE_ENV = "MODEWRIGHT_ALLOW_OUTSIDE"
"""Environment variable that allows files outside of the project; `--allow-outside` sets it."""

RECORDINGS_ENV = "MODEWRIGHT_RECORDINGS"
"""Environment variable with the folder of recordings, which may be outside of the project."""


def path_exists(path: Path) -> bool:
    """Return whether a path exists, as file or folder.

    A path that the operating system rejects (too long, a NUL character, no permission) does not
    exist.
    """
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def project_root_of(file: Path) -> Path:
    """Return the nearest folder above a file that contains a folder `spec`; else the file's folder.

    Symbolic links are resolved. The file need not exist.
    """
    parents = file.resolve().parents
    return next((parent for parent in parents if (parent / "spec").is_dir()), parents[0])


def require_inside_project(path: Path, span: Span, root: Path) -> None:
    """Raise SpecError if a spec names a file outside of its project; symbolic links are resolved.

    `path` is the named file and `span` the place that names it. Allowed are files below `root`, the
    project of the file of `span`, the specs of the distribution and the folder in RECORDINGS_ENV.
    There is no check if ALLOW_OUTSIDE_ENV is set, or if the named file or the file of `span` does
    not exist.
    """
    named_in = Path(span.source.name)
    if os.environ.get(ALLOW_OUTSIDE_ENV) or not path_exists(path) or not path_exists(named_in):
        return
    roots = [root, project_root_of(named_in), Path(str(resources.files("spec")))]
    if os.environ.get(RECORDINGS_ENV):
        roots.append(Path(os.environ[RECORDINGS_ENV]))
    resolved = path.resolve()
    if any(resolved.is_relative_to(allowed.resolve()) for allowed in roots):
        return
    problems = Problems()
    label = "this file is outside of the project"
    hint = f"its root is {project_root_of(named_in)}; "
    hint += "`modewright --allow-outside ...` reads the file nevertheless"
    problems.error("outside", span, label, hint)
    raise SpecError(problems.reported)
