"""The boundary of a project: which files outside of it a spec may name."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

from language.text.diagnostic import Problem, Source, Span, SpecError

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
    if not _is_below(path, [root, project_root_of(named_in)]):
        raise _outside_error(span, project_root_of(named_in))


def require_link_inside_project(path: Path, name: str) -> None:
    """Raise SpecError for a file of a project that a symbolic link places outside of it.

    The project is the nearest folder above the link that contains a folder `spec`; without one, or
    without a link, there is no check. `name` is the name of the file in the message. Allowed are
    the targets that `require_inside_project` allows, and files below the working folder.
    """
    if os.environ.get(ALLOW_OUTSIDE_ENV) or not path_exists(path):
        return
    link = Path(os.path.abspath(path))
    root = next((parent for parent in link.parents if (parent / "spec").is_dir()), None)
    if root and link != link.resolve() and not _is_below(link, [root, Path()]):
        raise _outside_error(Span(Source(name), 1, 1), root)


def _is_below(path: Path, roots: Sequence[Path]) -> bool:
    """Return whether a file is below a root, with the specs of the distribution and recordings.

    Symbolic links are resolved.
    """
    allowed = [*roots, Path(str(resources.files("spec")))]
    if os.environ.get(RECORDINGS_ENV):
        allowed.append(Path(os.environ[RECORDINGS_ENV]))
    resolved = path.resolve()
    return any(resolved.is_relative_to(folder.resolve()) for folder in allowed)


def _outside_error(span: Span, root: Path) -> SpecError:
    """Return the error of a file outside of a project, named at `span`."""
    hint = f"its root is {root}; `modewright --allow-outside ...` reads the file nevertheless"
    return SpecError([Problem("outside", span, "this file is outside of the project", hint)])
