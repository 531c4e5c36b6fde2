"""New project: write the files of a small project with plant, controller, scenario and test."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

from language.text.arguments import PathText, to_path, to_text
from language.text.temporary_files import postpone_signals
from modewright.runtime.output_files import OutputError

NAME_PATTERN = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,30}", re.ASCII)
"""The form of the name of a project."""
RESERVED_NAMES = frozenset({"room", "thermostat", "cold_day", "stays_warm", "ev_driveline"})
"""Names that the files of a project or the shipped specs use."""
TEMPLATE_TARGETS = {
    "room.yaml": "spec/room.yaml",
    "thermostat.yaml": "spec/thermostat.yaml",
    "system.yaml": "spec/system.yaml",
    "cold_day.yaml": "spec/cold_day.yaml",
    "stays_warm.yaml": "spec/stays_warm.yaml",
    "test_project.py.txt": "tests/test_project.py",
    "README.md.txt": "README.md",
}
"""The template files with their paths in the project."""


def skeleton_files(name: str) -> dict[str, str]:
    """Return the texts of the files of a new project by relative path, as in TEMPLATE_TARGETS.

    `PROJECT` in the templates is replaced by `name`, which is not checked here; it becomes the name
    of the system.
    """
    folder = resources.files("modewright.api") / "new_project_files"
    return {
        place: (folder / source).read_text("utf-8").replace("PROJECT", name)
        for source, place in TEMPLATE_TARGETS.items()
    }


def write_skeleton(name: str, folder: PathText) -> list[Path]:
    """Write a new project into a folder that does not exist yet, and return the paths of its files.

    The folder appears complete or not at all; missing parents are created. Raises ValueError for a
    name that does not match NAME_PATTERN or is in RESERVED_NAMES, and OutputError if the folder
    exists or cannot be written.
    """
    name, folder = to_text(name, "name"), to_path(folder, "folder")
    if not NAME_PATTERN.fullmatch(name) or name in RESERVED_NAMES:
        raise ValueError(f"`{name}` cannot be the name of a system: letters, digits and _")
    if folder.exists():
        raise OutputError(f"{folder}: it is there already")
    with postpone_signals():
        _write_files(skeleton_files(name), folder)
    return [folder / place for place in TEMPLATE_TARGETS.values()]


def _write_files(files: Mapping[str, str], folder: Path) -> None:
    """Write texts by relative path into a new folder; it appears complete or not at all.

    Raises OutputError.
    """
    temporary_folder = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary_folder = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        for place, text in files.items():
            path = temporary_folder / place
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, "utf-8")
        temporary_folder.chmod(0o755)
        temporary_folder.rename(folder)
    except OSError as error:
        raise OutputError(f"{folder}: {error.strerror}") from None
    finally:
        if temporary_folder is not None:
            shutil.rmtree(temporary_folder, ignore_errors=True)
