"""Builds the wheel: every package of the tree below `modewright`, with all of its files.

Packages are what has an `__init__.py`, so a new one needs no entry anywhere. In the wheel `engine/`
is `modewright/_engine/` and its imports are rewritten (`rename_imports.py`); the underscore keeps
functions such as `modewright.sweep` apart from packages. An editable installation leaves the
packages where they are: a line in a path file names the folder of the repository. Used by setup.py.
"""

import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from glob import escape
from pathlib import Path

from rename_imports import HOME, Packages, rename_imports, wheel_name
from setuptools.command.build_py import build_py  # type: ignore[import-untyped]
from setuptools.command.editable_wheel import editable_wheel  # type: ignore[import-untyped]

COMPILED = frozenset({".pyc", ".o", ".so", ".dylib"})
"""Endings of files that tools leave beside sources; .gitignore has the same."""


class LayoutError(ValueError):
    """A folder that cannot be packed."""


@dataclass(frozen=True)
class Layout:
    """What a tree holds: packages by dotted name, and the data files of each by relative path."""

    packages: tuple[str, ...]
    data: Mapping[str, tuple[str, ...]]
    names: Packages


def layout_of(root: Path) -> Layout:
    """Return the layout of a repository or of an unpacked source distribution.

    Raises LayoutError for a module in a folder without `__init__.py`.
    """
    folders = sorted(path.parent for path in root.glob("*/__init__.py"))
    data: dict[str, list[str]] = {}
    modules: set[str] = set()
    for path in sorted(file for folder in folders for file in _files(folder)):
        package = path.parent
        if path.suffix == ".py":
            if not (package / "__init__.py").is_file():
                raise LayoutError(f"{path}: there is no `__init__.py` beside it")
            named = package if path.name == "__init__.py" else path.with_suffix("")
            modules.add(_dotted(named, root))
        while not (package / "__init__.py").is_file():
            package = package.parent
        files = data.setdefault(_dotted(package, root), [])
        if path.suffix != ".py":
            files.append(path.relative_to(package).as_posix())
    moved = frozenset(folder.name for folder in folders) - {HOME}
    whole = {package: tuple(files) for package, files in data.items()}
    return Layout(tuple(sorted(whole)), whole, Packages(moved, frozenset(modules)))


def _files(folder: Path) -> Iterator[Path]:
    for path in folder.rglob("*"):
        parts = path.relative_to(folder).parts
        is_left = any(part.startswith(".") or part == "__pycache__" for part in parts)
        if path.is_file() and not is_left and path.suffix not in COMPILED:
            yield path


def _dotted(path: Path, root: Path) -> str:
    return ".".join(path.relative_to(root).parts)


class BuildPackages(build_py):  # type: ignore[misc]
    """Copies modules to their places in the wheel and rewrites their imports."""

    def run(self) -> None:
        """Copy all packages into an empty folder: no module of an earlier build stays in it."""
        self.names = layout_of(Path()).names
        if not self.editable_mode:
            shutil.rmtree(self.build_lib, ignore_errors=True)
        super().run()

    def build_module(self, module: str, module_file: str, package: str) -> tuple[str, bool]:
        """Copy one module and rewrite the copy. Raises RenameError."""
        written, is_new = super().build_module(module, module_file, package)
        text = Path(module_file).read_bytes().decode()
        copy = Path(written)
        copy.unlink()  # it may be read-only like its source
        copy.write_bytes(rename_imports(text, module_file, self.names).encode())
        return str(written), bool(is_new)


class InstallEditable(editable_wheel):  # type: ignore[misc]
    """Installs the packages under the names that they have in the repository."""

    def initialize_options(self) -> None:
        """Name the packages as they lie in the tree."""
        super().initialize_options()
        self.distribution.packages = list(layout_of(Path()).packages)
        self.distribution.package_dir = {"": "."}
        self.distribution.package_data = {}


def setup_arguments(root: Path) -> dict[str, object]:
    """Return what `setuptools.setup` is told: packages, their folders, their data, our commands."""
    layout = layout_of(root)
    places = {wheel_name(package, layout.names): package for package in layout.packages}
    return {
        "packages": list(places),
        "package_dir": {name: package.replace(".", "/") for name, package in places.items()},
        "package_data": {
            name: [escape(file) for file in layout.data[package]]
            for name, package in places.items()
        },
        "cmdclass": {"build_py": BuildPackages, "editable_wheel": InstallEditable},
    }
