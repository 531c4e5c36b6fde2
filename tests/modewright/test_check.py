"""Check: what it loads, and what it says to machines."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
HEAVY = ("numpy", "scipy", "matplotlib", "jinja2", "filterpy")


def test_check_loads_neither_numerics_nor_generator() -> None:
    code = "import sys; sys.argv = ['modewright', 'check', 'tip_out', '--json']\n"
    code += "from modewright.cli import main\ntry: main()\nexcept SystemExit as e: code = e.code\n"
    code += f"print([name for name in {HEAVY} if name in sys.modules], code)"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[] 0", done.stdout


def test_a_problem_has_every_key_in_json(tmp_path: Path) -> None:
    path = tmp_path / "twice.yaml"
    path.write_text("language: 1\nautomaton: twice\nautomaton: twice\n")
    done = subprocess.run(
        [sys.executable, "-m", "modewright", "check", str(path), "--json"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    (problem,) = json.loads(done.stdout)["problems"]
    assert problem == {
        "severity": "error",
        "kind": "duplicate",
        "file": str(path),
        "line": 3,
        "column": 1,
        "message": "`automaton` is given twice",
        "help": f"it is given first at {path}:2:1",
    }
