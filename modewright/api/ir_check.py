"""Check of the intermediate representation: the Programs of a spec after lowering and each pass."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from codegen.passes.pass_list import C_PASSES
from language.ir.program import Program
from language.ircheck.check_program import check_program
from language.ircheck.violation import Violation
from language.loading.load import automaton_of, lower_automaton
from language.loading.system_reader import read_system
from language.model.automaton import Automaton
from language.overlays.expand_document import Project, expand_document
from language.passes.pass_list import LANGUAGE_PASSES
from language.passes.program_pass import LOWERED_PROPERTIES, run_each
from language.text.arguments import PathText, to_project, to_text

LOWERED = "lowered"
"""The name of the Program before all passes."""


@dataclass(frozen=True)
class IrCheck:
    """The violations of the Programs of one automaton, by the pass after which they are there.

    The keys of `violations` are LOWERED and the names of all passes, in their order.
    """

    automaton: str
    violations: dict[str, tuple[Violation, ...]]

    @property
    def is_valid(self) -> bool:
        """Return whether there are no violations."""
        return not any(self.violations.values())


def check_ir(spec: PathText, root: PathText | None = None) -> tuple[IrCheck, ...]:
    """Return the checks of the Programs of a spec, one for each of its automata.

    An automaton has one, a system one for each automaton of its instances; other kinds of specs
    have none. `root` is the folder of the project (default: the working folder). Raises SpecError
    for a spec with errors.
    """
    automata = _automata_of(to_text(spec, "spec"), to_project(root))
    return tuple(_check_automaton(automaton) for automaton in automata)


def ir_check_json(check: IrCheck) -> dict[str, Any]:
    """Return a check as a dict for JSON: `automaton`, `passes`, and `violations`.

    A violation has the keys pass, rule, place and message.
    """
    return {
        "automaton": check.automaton,
        "passes": list(check.violations),
        "violations": [
            {"pass": name, "rule": one.rule, "place": one.place, "message": one.message}
            for name, found in check.violations.items()
            for one in found
        ],
    }


def _automata_of(spec: str, project: Project) -> list[Automaton]:
    """Return the automata of a spec, each once."""
    document = project.read(project.path_of(spec))
    kind = expand_document(document, project).kind
    if kind == "automaton":
        return [automaton_of(document, project)]
    if kind != "system":
        return []
    instances = read_system(document, project).instances.values()
    found: list[Automaton] = []
    for one in instances:
        if one.automaton not in found:
            found.append(one.automaton)
    return found


def _check_automaton(automaton: Automaton) -> IrCheck:
    """Return the check of an automaton's Program after lowering and after each pass."""
    return IrCheck(automaton.name, dict(_check_passes(lower_automaton(automaton))))


def _check_passes(program: Program) -> Iterator[tuple[str, tuple[Violation, ...]]]:
    """Yield the name of each pass with the violations of its result, LOWERED first."""
    yield LOWERED, check_program(program, LOWERED_PROPERTIES)
    for result in run_each(program, (*LANGUAGE_PASSES, *C_PASSES)):
        yield result.step.name, check_program(result.after, result.properties)
