"""Command doctor: check the installation."""

from __future__ import annotations

import typer

from modewright.cli.common.console import console
from modewright.cli.common.exit_codes import PROBLEMS, TOOL
from modewright.cli.common.options import Json
from modewright.runtime.json_format import format_entry


def doctor(as_json: Json = False) -> None:
    """Check Python, packages, compiler and cache, and run a self-test.

    Exit code 3: the compiler or a package is missing; 1: another check failed.

    \b
    modewright doctor
    modewright doctor --json
    """
    from modewright.api.doctor import run_health_checks
    from modewright.render import run as show

    found = []
    for finding in run_health_checks():
        found.append(finding)
        if not as_json:
            show.print_health_check(console(), finding)
    if as_json:
        findings = [vars(finding) for finding in found]
        show.print_json({**format_entry("doctor"), "findings": findings})
    faults = [finding for finding in found if finding.verdict == "fault"]
    if faults:
        others = ("modewright", "cache", "self-test", "python")
        raise typer.Exit(PROBLEMS if all(f.name in others for f in faults) else TOOL)
