"""All: every check of the C of a Program, one after the other."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from codegen.proofs.contract import contract
from codegen.proofs.misra import misra
from codegen.proofs.proof import Proof
from codegen.proofs.sanitised import sanitised
from codegen.proofs.stack import stack
from codegen.proofs.strict import strict
from codegen.proofs.values import values
from codegen.source import c_files
from language.model import Automaton
from language.program import Program

CHECKS = ("warnings", "misra", "stack", "sanitizers", "values", "contract")


def proofs(
    automaton: Automaton, program: Program, checks: Sequence[str] = CHECKS
) -> Iterator[Proof]:
    """Yield what each check says. Raises ToolMissing, BuildError."""
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
        for inner in ("sanitizers", "values", "contract"):
            (folder / inner).mkdir()
        files = c_files(program)
        for file, text in files.items():
            (folder / file).write_text(text)
        sources = [file for file in files if file.endswith(".c")]
        made: dict[str, Callable[[], list[Proof]]] = {
            "warnings": lambda: strict(folder, sources),
            "misra": lambda: [misra(folder, sources)],
            "stack": lambda: [stack(folder, sources, f"{program.name}_Step")],
            "sanitizers": lambda: [sanitised(program, folder / "sanitizers")],
            "values": lambda: [values(program, folder / "values")],
            "contract": lambda: [contract(automaton, program, folder / "contract")],
        }
        for check in checks:
            yield from made[check]()
