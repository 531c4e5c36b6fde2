"""Writes a module's text for the wheel, where `engine` is `modewright._engine`. Pure text.

In the repository the packages are top-level. In the wheel each is below `modewright`, so that it
meets no `engine.py` of a user. Rewritten are, by their places in the syntax tree:

    from engine.frame import Frame    ->  from modewright._engine.frame import Frame
    import engine.frame as frame      ->  import modewright._engine.frame as frame
    import engine                     ->  import modewright._engine as engine
    files("engine"), "-m", "engine.x" ->  files("modewright._engine"), "-m", "modewright._engine.x"
    "engine.frame"                    ->  "modewright._engine.frame"

A string is rewritten where it stands for a module by its position (the argument of a function in
`MODULE_FUNCTIONS`, a key of `sys.modules`, what follows "-m"), or where all of it is the dotted
name of a module that exists. Docstrings and comments stay. Text that names a package of ours in
another way raises `RenameError`. Standard library only.
"""

import ast
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

HOME = "modewright"
"""The package that holds the others in the wheel."""
MODULE_FUNCTIONS = frozenset({"files", "import_module", "find_spec", "__import__", "run_module"})
"""Functions whose first argument is the name of a module."""
DOTTED = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)+")


class RenameError(ValueError):
    """A place in a module that cannot be written for the wheel."""


@dataclass(frozen=True)
class Packages:
    """The top-level packages that move below `HOME`, and the dotted names of all modules."""

    moved: frozenset[str]
    modules: frozenset[str]

    def moves(self, name: str) -> bool:
        """Tell whether a dotted name begins with a package that moves."""
        return name.partition(".")[0] in self.moved


@dataclass(frozen=True)
class Edit:
    """Bytes `start` to `end` of a text are replaced by `new`."""

    start: int
    end: int
    new: bytes


@dataclass(frozen=True)
class Module:
    """The text of a module as bytes, the offset of each line, and what it may name."""

    file: str
    data: bytes
    lines: tuple[int, ...]
    packages: Packages

    def offset(self, line: int, column: int) -> int:
        """Return the offset of a place of the syntax tree: lines count from 1, columns in bytes."""
        return self.lines[line - 1] + column

    def error(self, node: ast.expr | ast.stmt | ast.alias, what: str, advice: str) -> RenameError:
        """Return the error of a place."""
        return RenameError(f"{self.file}:{node.lineno}: {what}: {advice}")

    def require_module(self, node: ast.expr | ast.stmt | ast.alias, name: str) -> None:
        """Raise RenameError where there is no module of this name."""
        if name not in self.packages.modules:
            raise self.error(node, f"`{name}`", "there is no such module")


def wheel_name(name: str, packages: Packages) -> str:
    """Return the dotted name that a module has in the wheel."""
    return f"{HOME}._{name}" if packages.moves(name) else name


def rename_imports(text: str, file: str, packages: Packages) -> str:
    """Return the text of a module as it stands in the wheel. Raises RenameError."""
    data = text.encode()
    starts = [0]
    for line in data.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    module = Module(file, data, tuple(starts), packages)
    tree = ast.parse(data, file)
    edits = {*_import_edits(module, tree), *_string_edits(module, tree)}
    for edit in sorted(edits, key=lambda edit: edit.start, reverse=True):
        data = data[: edit.start] + edit.new + data[edit.end :]
    return data.decode()


def _import_edits(module: Module, tree: ast.Module) -> Iterator[Edit]:
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            if module.packages.moves(node.module):
                yield _from_edit(module, node, node.module)
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if module.packages.moves(alias.name):
                    yield _alias_edit(module, alias)


def _from_edit(module: Module, node: ast.ImportFrom, name: str) -> Edit:
    module.require_module(node, name)
    start = module.offset(node.lineno, node.col_offset) + len("from ")
    written = b"from " + name.encode() + b" import"
    if not module.data.startswith(written, start - len("from ")):
        raise module.error(node, f"`from {name}`", "write `from name import` with single spaces")
    return Edit(start, start + len(name.encode()), wheel_name(name, module.packages).encode())


def _alias_edit(module: Module, alias: ast.alias) -> Edit:
    name, start = alias.name, module.offset(alias.lineno, alias.col_offset)
    module.require_module(alias, name)
    if not module.data.startswith(name.encode(), start):
        raise module.error(alias, f"`import {name}`", "write the name without spaces")
    new = wheel_name(name, module.packages)
    if alias.asname is None:
        if "." in name:
            above, _, last = name.rpartition(".")
            raise module.error(alias, f"`import {name}`", f"write `from {above} import {last}`")
        new = f"{new} as {name}"
    return Edit(start, start + len(name.encode()), new.encode())


def _string_edits(module: Module, tree: ast.Module) -> Iterator[Edit]:
    unread = set(_docstrings_and_parts(tree))
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield from _called_edits(module, node)
            yield from _option_edits(module, node.args)
        elif isinstance(node, ast.Tuple | ast.List):
            yield from _option_edits(module, node.elts)
        elif isinstance(node, ast.Subscript) and _last_name(node.value) == "modules":
            yield from _module_edits(module, node.slice)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in unread:
            yield from _dotted_edits(module, node, node.value)


def _docstrings_and_parts(tree: ast.Module) -> Iterator[ast.expr]:
    """Yield strings that are statements, and the parts of f-strings."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr):
            yield node.value
        elif isinstance(node, ast.JoinedStr):
            yield from node.values


def _last_name(node: ast.expr) -> str:
    """Return `files` of `files` and of `resources.files`."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def _called_edits(module: Module, call: ast.Call) -> Iterator[Edit]:
    if _last_name(call.func) not in MODULE_FUNCTIONS:
        return
    for argument in (*call.args[:1], *(keyword.value for keyword in call.keywords)):
        if isinstance(argument, ast.JoinedStr | ast.BinOp):
            for part in ast.walk(argument):
                value = part.value if isinstance(part, ast.Constant) else None
                if isinstance(value, str) and module.packages.moves(value):
                    what = f"a name made of `{value}` and more"
                    raise module.error(argument, what, "write the names of modules as literals")
        yield from _module_edits(module, argument)


def _option_edits(module: Module, arguments: Sequence[ast.expr]) -> Iterator[Edit]:
    """Yield the edits of what follows "-m" in the arguments of a command."""
    for option, argument in pairwise(arguments):
        if isinstance(option, ast.Constant) and option.value == "-m":
            yield from _module_edits(module, argument)


def _module_edits(module: Module, node: ast.expr) -> Iterator[Edit]:
    """Yield the edit of a string that is the name of a module by its position."""
    value = node.value if isinstance(node, ast.Constant) else None
    if isinstance(value, str) and module.packages.moves(value):
        module.require_module(node, value)
        yield _literal_edit(module, node, value)


def _dotted_edits(module: Module, node: ast.Constant, value: str) -> Iterator[Edit]:
    """Yield the edit of a string that is the dotted name of a module wherever it stands."""
    names = "|".join(sorted(module.packages.moved))
    if re.search(rf"^\s*(from ({names})(\.\w+)* import|import ({names}))\b", value, re.MULTILINE):
        raise module.error(node, "code in a string imports a package", "import it in a module")
    if not (DOTTED.fullmatch(value) and module.packages.moves(value)):
        return
    if value in module.packages.modules:
        yield _literal_edit(module, node, value)
    elif ".".join(value.split(".")[:2]) in module.packages.modules:
        advice = "name the module alone, or import what is in it"
        raise module.error(node, f'"{value}" names no module, but begins like one', advice)


def _literal_edit(module: Module, node: ast.expr, value: str) -> Edit:
    start = module.offset(node.lineno, node.col_offset)
    end = module.offset(node.end_lineno or node.lineno, node.end_col_offset or 0)
    written = module.data[start:end].decode()
    if written not in (f'"{value}"', f"'{value}'"):
        raise module.error(node, f"`{written}`", "write the name of a module as one plain literal")
    return Edit(start + 1, end - 1, wheel_name(value, module.packages).encode())
