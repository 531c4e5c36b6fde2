"""All checks of the C of a Program, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from codegen.emit.c_module import emit_c_files
from codegen.harness.stack_usage import check_stack
from codegen.proofs.acsl.mode_contract import check_contracts
from codegen.proofs.eva import check_values
from codegen.proofs.misra import check_misra
from codegen.proofs.sanitizer_run import check_sanitizers
from codegen.proofs.warnings import check_compiler_warnings
from codegen.toolchain.tool_verdict import ToolVerdict
from language.ir.program import Program
from language.model.automaton import Automaton
from language.text.temporary_files import temporary_folder

CHECKS = ("warnings", "misra", "stack", "sanitizers", "values", "contract")
"""The names of all checks in their order."""


def run_checks(
    automaton: Automaton, program: Program, checks: Sequence[str] = CHECKS
) -> Iterator[ToolVerdict]:
    """Yield the verdicts of the named checks in their order.

    Raises MissingToolError, BuildError.
    """
    with temporary_folder() as folder:
        for inner in ("sanitizers", "values", "contract"):
            (folder / inner).mkdir()
        files = emit_c_files(program)
        for file, text in files.items():
            (folder / file).write_text(text)
        sources = [file for file in files if file.endswith(".c")]
        check_functions: dict[str, Callable[[], list[ToolVerdict]]] = {
            "warnings": lambda: check_compiler_warnings(folder, sources),
            "misra": lambda: [check_misra(folder, sources)],
            "stack": lambda: [check_stack(folder, sources, f"{program.name}_Step")],
            "sanitizers": lambda: [check_sanitizers(program, folder / "sanitizers")],
            "values": lambda: [check_values(program, folder / "values")],
            "contract": lambda: [check_contracts(automaton, program, folder / "contract")],
        }
        for check in checks:
            yield from check_functions[check]()
