"""Made: refused files that are not committed - too large, absent, special - and neighbours."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from language.text.document import MAX_BYTES
from language.text.yaml_parser import MAX_DEPTH

SPEC = """language: 1
automaton: made
states: {x: {unit: m, initial: 0 m}}
modes: {only: {flow: {x: der(x) = 1 m/s}}}
outputs: [x]
"""
Pair = tuple[Path, Path]
STUDY = """language: 1
study: made_study
of: made.yaml
scenarios: [still.yaml]
measures: {last: {final: x}}
"""


def store(folder: Path) -> Pair:
    """A folder without results of a study, and one with them."""
    from modewright.api.studies import sweep

    (folder / "made.yaml").write_text(SPEC)
    (folder / "still.yaml").write_text(
        "language: 1\nscenario: still\nof: made.yaml\nhorizon: 1 ms\n"
    )
    (folder / "study.yaml").write_text(STUDY)
    sweep(str(folder / "study.yaml"), folder / "results", root=folder, workers=1)
    refused, neighbour = folder / "empty.command", folder / "full.command"
    refused.write_text(f"summary {folder / 'nothing'}\n")
    neighbour.write_text(f"summary {folder / 'results'}\n")
    return refused, neighbour


def huge(folder: Path) -> Pair:
    """A file one byte above the limit, and one at it."""
    refused, neighbour = folder / "huge.yaml", folder / "largest.yaml"
    comment = "#" * 99 + "\n"
    text = SPEC + comment * ((MAX_BYTES - len(SPEC)) // len(comment))
    text += "#" * (MAX_BYTES - len(text) - 1) + "\n"
    neighbour.write_text(text)
    refused.write_text(text + "\n")
    return refused, neighbour


def absent(folder: Path) -> Pair:
    """A file that is not there."""
    neighbour = folder / "present.yaml"
    neighbour.write_text(SPEC)
    return folder / "absent.yaml", neighbour


def folder_as_file(folder: Path) -> Pair:
    """A directory where a file is wanted."""
    (folder / "folder.yaml").mkdir()
    return folder / "folder.yaml", absent(folder)[1]


def deep(folder: Path) -> Pair:
    """Brackets nested one level too deeply, and lists as deep as can be, in `about`."""
    refused, neighbour = folder / "deep.yaml", folder / "deepest.yaml"
    for path, levels in ((refused, MAX_DEPTH), (neighbour, MAX_DEPTH - 1)):
        path.write_text(SPEC + f"about: {'[' * levels}text{']' * levels}\n")
    return refused, neighbour


SLEDGE = """language: 1
automaton: sledge
inputs: {u: {unit: m/s^2, default: 0 m/s^2}}
states: {v: {unit: m/s, initial: 0 m/s}}
modes: {glides: {flow: {v: der(v) = u - 1 1/s * abs(v - 2 m/s)}}}
outputs: [v]
"""
WATCHER = """language: 1
automaton: watcher
period: 10 ms
numbers: float64
model: sledge.yaml
inputs: {y_v: {unit: m/s}}
states: {v: {initial: y_v}}
modes:
  only:
    observer:
      of: sledge.glides
      kalman: {states: [v]}
      at: {v: 2 m/s}
      measures: {y_v: v}
      process_noise: {v: 1 m^2/s^3}
      measurement_noise: {y_v: 0.1 m^2/s^2}
outputs: [v]
"""


def corner(folder: Path) -> Pair:
    """An observer at a point where its model has a corner, and one beside it."""
    refused, neighbour = folder / "corner.yaml", folder / "beside.yaml"
    (folder / "sledge.yaml").write_text(SLEDGE)
    refused.write_text(WATCHER)
    neighbour.write_text(WATCHER.replace("2 m/s", "3 m/s"))
    return refused, neighbour


def outside(folder: Path) -> Pair:
    """A variant that lies inside a project and extends a file above it, by a link too."""
    secret = folder / "secret.yaml"
    secret.write_text(SPEC)
    spec = folder / "project" / "spec"
    spec.mkdir(parents=True)
    (spec / "inside.yaml").write_text(SPEC)
    (spec / "link.yaml").symlink_to(secret)
    head = "language: 1\nvariant: over\nextends: "
    refused, neighbour = spec / "refused.yaml", spec / "neighbour.yaml"
    refused.write_text(f"{head}link.yaml\n")
    neighbour.write_text(f"{head}../spec/inside.yaml\n")
    return refused, neighbour


GENERATED_CASES: dict[str, Callable[[Path], Pair]] = {
    "store": store,
    "huge": huge,
    "absent": absent,
    "folder": folder_as_file,
    "deep": deep,
    "outside": outside,
    "corner": corner,
}
