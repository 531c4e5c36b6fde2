"""Running: the events of a case through the interpreter, and those of many cases through C."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codegen.emit.c_module import emit_c_files
from codegen.emit.c_names import CNames
from codegen.toolchain.compiler import FLAGS, WARNINGS, find_compiler
from engine.interpreter.interpreter import Interpreter
from language.ir.program import Program
from language.loading.load import automaton_of, program_of
from language.model.automaton import Automaton
from language.overlays.expand_document import Project, read_document
from tests.semantics.scxml.translation import Case, translate_case

Active = frozenset[str]


@dataclass(frozen=True)
class LoadedCase:
    """A case with its Program, the script of its events, and what is to be active after each."""

    case: Case
    automaton: Automaton
    program: Program
    events: Sequence[str | None]
    expected: Sequence[Active]

    def active(self, numbers: Mapping[str, int]) -> Active:
        """Return the ids of the innermost active states, from the numbers of the regions."""
        chart = self.automaton.statechart
        assert chart is not None
        found = set()
        for region in chart.regions:
            for leaf in chart.leaves(region.region):
                if leaf.number == numbers[region.region] and leaf.kind == "atomic":
                    found.add(self.case.ids[leaf.path])
        return frozenset(found)


def load_case(raw: Mapping[str, Any], name: str, folder: Path) -> LoadedCase:
    """Return a case through the whole front end."""
    case = translate_case(raw, name)
    home = folder / name / "spec"
    home.mkdir(parents=True)
    (home / f"{name}.yaml").write_text(case.text)
    project = Project(home.parent)
    automaton = automaton_of(read_document(project.path_of(name)), project)
    events = [None, *(step["event"] for step in raw["steps"])]
    wanted = [raw["initial"], *(step["expect"] for step in raw["steps"])]
    return LoadedCase(
        case, automaton, program_of(automaton), events, [frozenset(w) for w in wanted]
    )


def run_interpreted(loaded: LoadedCase) -> list[Active]:
    """Return what is active after each event, as the interpreter has it."""
    stepper = Interpreter(loaded.program)
    found = []
    for event in loaded.events:
        for name, ours in loaded.case.events.items():
            stepper.set(f"input.{ours}", name == event)
        stepper.run("step")
        assert stepper.get("memory.faults") == 0
        variables = loaded.program.mode_variables().items()
        found.append(loaded.active({region: stepper.get(name) for region, name in variables}))
    return found


def run_compiled(cases: Sequence[LoadedCase], folder: Path) -> list[list[Active]]:
    """Return the same of C: all cases are one executable, for a compiler's start takes longest."""
    for one in cases:
        for name, text in emit_c_files(one.program).items():
            (folder / name).write_text(text)
    (folder / "all.c").write_text(_main(cases))
    sources = ["all.c", *(f"{one.program.name}.c" for one in cases)]
    flags = [flag for flag in FLAGS if not flag.startswith("-O")]
    command = [*find_compiler(), *flags, "-O0", *WARNINGS, "-Werror", *sources, "-o", "all"]
    built = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)
    assert built.returncode == 0, built.stderr[:4000]
    run = subprocess.run(["./all"], cwd=folder, capture_output=True, text=True, timeout=60)
    lines = iter(run.stdout.splitlines())
    found = []
    for one in cases:
        regions = list(one.program.mode_variables())
        rows = [[int(word) for word in next(lines).split()] for _ in one.events]
        found.append([one.active(dict(zip(regions, row, strict=True))) for row in rows])
    return found


def _main(cases: Iterable[LoadedCase]) -> str:
    lines = ["#include <stdio.h>", "#include <string.h>"]
    lines += [f'#include "{one.program.name}.h"' for one in cases]
    body = ["int main(void)", "{"]
    for one in cases:
        body += _script(one)
    return "\n".join([*lines, *body, "    return 0;", "}", ""])


def _script(one: LoadedCase) -> list[str]:
    """The events of one case; after each, the modes of its regions on one line."""
    name, place = one.program.name, CNames(one.program)
    modes = [place(v).replace("self->", "self.") for v in one.program.mode_variables().values()]
    text = " ".join("%d" for _ in modes)
    show = f'        printf("{text}\\n", {", ".join(f"(int){mode}" for mode in modes)});'
    lines = ["    {", f"        {name}_Self self;", f"        {name}_In in;"]
    lines += [f"        {name}_Out out;", f"        {name}_Init(&self, &{name}_default_cal);"]
    for event in one.events:
        lines.append("        memset(&in, 0, sizeof in);")
        if event is not None:
            lines.append(f"        in.{one.case.events[event]} = true;")
        lines += [f"        {name}_Step(&self, &{name}_default_cal, &in, &out);", show]
    return [*lines, "    }"]
