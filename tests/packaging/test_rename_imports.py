"""What is rewritten of a module for the wheel, what stays, and what is refused."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from build_wheel import LayoutError, layout_of, setup_arguments
from rename_imports import Packages, RenameError, rename_imports

ROOT = Path(__file__).parents[2]
PACKAGES = Packages(
    frozenset({"engine", "spec", "sweep"}),
    frozenset(
        {
            *("engine", "engine.frame", "engine.runs", "engine.runs.cruise", "spec"),
            *("sweep", "sweep.worker", "modewright", "modewright.sweep"),
        }
    ),
)


def rewritten(text: str) -> str:
    return rename_imports(text, "made.py", PACKAGES)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("from engine import frame", "from modewright._engine import frame"),
        ("from engine.frame import Frame", "from modewright._engine.frame import Frame"),
        ("from engine.runs.cruise import *", "from modewright._engine.runs.cruise import *"),
        (
            "from engine.frame import (  # why\n    Frame,\n)",
            "from modewright._engine.frame import (  # why\n    Frame,\n)",
        ),
        (
            "if TYPE_CHECKING:\n    from engine.frame import Frame",
            "if TYPE_CHECKING:\n    from modewright._engine.frame import Frame",
        ),
        (
            "a = 'Ü'; from engine import frame; from sweep import worker",
            "a = 'Ü'; from modewright._engine import frame; from modewright._sweep import worker",
        ),
        ("import engine", "import modewright._engine as engine"),
        ("import engine as e", "import modewright._engine as e"),
        ("import engine.frame as frame", "import modewright._engine.frame as frame"),
        (
            "import os, engine, sweep.worker as worker",
            "import os, modewright._engine as engine, modewright._sweep.worker as worker",
        ),
        ('files("spec") / "spec"', 'files("modewright._spec") / "spec"'),
        ("resources.files('engine')", "resources.files('modewright._engine')"),
        ('files(anchor="engine")', 'files(anchor="modewright._engine")'),
        ('import_module("engine.frame")', 'import_module("modewright._engine.frame")'),
        ('sys.modules["engine"]', 'sys.modules["modewright._engine"]'),
        (
            'RUN = (sys.executable, "-P", "-m", "sweep")',
            'RUN = (sys.executable, "-P", "-m", "modewright._sweep")',
        ),
        ('run(python, "-m", "engine.frame")', 'run(python, "-m", "modewright._engine.frame")'),
        ('P = {"Frame": "engine.frame"}', 'P = {"Frame": "modewright._engine.frame"}'),
    ],
)
def test_what_names_a_module_is_rewritten(before: str, after: str) -> None:
    assert rewritten(before) == after
    assert rewritten(f"x = 1\r\n{before}\r\ny = 2\r\n") == f"x = 1\r\n{after}\r\ny = 2\r\n"
    assert rewritten(after) == after


@pytest.mark.parametrize(
    "text",
    [
        "from modewright import sweep",
        "from modewright.sweep import engine",
        "from . import engine",
        "from .engine import frame",
        "from engines import frame",
        "import numpy.engine",
        "engine = 1",
        "sweep.worker = engine.frame",
        'root / "spec"',
        'NAMES = ("engine", "sweep")',
        'name == "spec"',
        '"engine.py"',
        '"spec.toml"',
        '"engine.frame is a module"',
        'f"engine.frame{x}"',
        'f"{x}engine.frame"',
        'b"engine.frame"',
        '"engine/frame.py"',
        '"modewright.sweep"',
        "import_module(PLACES.get(name, 'modewright.sweep'))",
        'Option("--map", "-m", help="spec")',
        "# import engine.frame",
        '"""Docstring:\n\nimport engine.frame\n"""',
        'def f():\n    """engine.frame"""\n',
        "",
    ],
)
def test_what_names_no_module_stays(text: str) -> None:
    assert rewritten(text) == text


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("import engine.frame", "write `from engine import frame`"),
        ("import engine.runs.cruise", "write `from engine.runs import cruise`"),
        ("from engine.gone import x", "`engine.gone`: there is no such module"),
        ("import gone, engine.gone as g", "there is no such module"),
        ("from  engine import frame", "single spaces"),
        ("from engine . frame import x", "single spaces"),
        ("import engine . frame as f", "without spaces"),
        ('import_module("engine.gone")', "there is no such module"),
        ('import_module("engine." + name)', "a name made of `engine.` and more"),
        ('import_module(f"engine.{name}")', "a name made of `engine.` and more"),
        ('files("engine" "")', "one plain literal"),
        ('x = "engine" ".frame"', "one plain literal"),
        ('x = r"engine.frame"', "one plain literal"),
        ('x: "engine.frame.Frame"', '"engine.frame.Frame" names no module, but begins like one'),
        ('run("import sys\\nimport engine")', "code in a string"),
        ('run("from engine.frame import Frame")', "code in a string"),
        ('run(python, "-m", "engine.gone")', "there is no such module"),
    ],
)
def test_what_is_not_understood_is_refused_with_its_place(text: str, told: str) -> None:
    with pytest.raises(RenameError) as refused:
        rewritten(f"import os\n{text}")
    assert str(refused.value).startswith("made.py:2: ") and told in str(refused.value)


@pytest.mark.long
def test_every_module_of_the_tree_can_be_rewritten() -> None:
    names = layout_of(ROOT).names
    for module in names.modules:
        path = ROOT.joinpath(*module.split("."))
        file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        text = file.read_text("utf-8")
        made = rename_imports(text, str(file), names)
        assert len(ast.dump(ast.parse(made))) >= len(ast.dump(ast.parse(text)))
        assert made.count("\n") == text.count("\n")


def write(root: Path, *files: str) -> None:
    for file in files:
        (root / file).parent.mkdir(parents=True, exist_ok=True)
        (root / file).write_text("")


def test_packages_and_their_data_are_found(tmp_path: Path) -> None:
    write(
        tmp_path,
        *("modewright/__init__.py", "modewright/py.typed", "setup.py", "tests/test_a.py"),
        *("engine/__init__.py", "engine/runs/__init__.py", "engine/runs/cruise.py"),
        *("engine/runs/templates/deep/[a].jinja", "engine/README.md", "docs/index.md"),
        *("engine/__pycache__/a.pyc", "engine/.hidden", "engine/kept.so"),
    )
    layout = layout_of(tmp_path)
    assert layout.packages == ("engine", "engine.runs", "modewright")
    assert layout.names.moved == {"engine"}
    assert layout.names.modules == {*layout.packages, "engine.runs.cruise"}
    arguments = setup_arguments(tmp_path)
    assert arguments["package_dir"] == {
        "modewright": "modewright",
        "modewright._engine": "engine",
        "modewright._engine.runs": "engine/runs",
    }
    assert arguments["package_data"] == {
        "modewright": ["py.typed"],
        "modewright._engine": ["README.md"],
        "modewright._engine.runs": ["templates/deep/[[]a].jinja"],
    }


def test_a_module_beside_no_init_is_refused(tmp_path: Path) -> None:
    write(tmp_path, "engine/__init__.py", "engine/runs/cruise.py")
    with pytest.raises(LayoutError, match=r"cruise\.py: there is no `__init__\.py` beside it"):
        layout_of(tmp_path)
