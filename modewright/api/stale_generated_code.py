"""Stale generated code: compare the C below a folder with the specs of the project."""

from __future__ import annotations

from pathlib import Path

from codegen.emit.c_module import emit_c_files
from language.loading.load import automaton_of, program_of
from language.overlays.expand_document import expand_document, read_document
from language.text.arguments import PathText, to_path, to_project
from modewright.api.spec_check import no_spec_error, spec_files


def generated_files(root: PathText, out: PathText) -> dict[Path, bytes]:
    """Return the bytes of each file that belongs below the folder `out`, by path.

    The C of each automaton in `spec/<folder>/` of the project `root` belongs in `out/<folder>/`;
    other kinds of specs are skipped. Writes no file. Raises SpecError, also if the project has no
    spec.
    """
    project, out_folder = to_project(root), to_path(out, "out")
    files: dict[Path, bytes] = {}
    paths = list(spec_files(project.root))
    if not paths:
        raise no_spec_error(project.root / "spec")
    for path in paths:
        document = read_document(path)
        if expand_document(document, project).kind != "automaton":
            continue
        automaton = automaton_of(document, project)
        folder = out_folder / path.parent.relative_to(project.root / "spec")
        for name, text in emit_c_files(program_of(automaton)).items():
            files[folder / name] = text.encode()
    return files


def stale_files(root: PathText, out: PathText) -> list[str]:
    """Return one line for each missing, different or superfluous file below the folder `out`.

    A line is `path: reason`. Superfluous are `*.h` and `*.c` that no spec generates; they come
    last. Empty if all is up to date. Raises SpecError.
    """
    expected = generated_files(root, out)
    present = {path for path in to_path(out, "out").rglob("*.[ch]") if path.is_file()}
    lines = []
    for path, data in expected.items():
        if path not in present:
            lines.append(f"{path}: missing")
        elif path.read_bytes() != data:
            lines.append(f"{path}: differs from what the specs give")
    lines += [f"{path}: left over" for path in sorted(present - set(expected))]
    return lines
