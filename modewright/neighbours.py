"""Neighbours: the packages installed beside this one; no folder of the user's may hide them."""

from __future__ import annotations

import os
import sys
from importlib.util import module_from_spec, spec_from_file_location

OWN_PACKAGES = (
    "language",
    "engine",
    "codegen",
    "expectation",
    "lockstep",
    "sweep",
    "diagnosis",
    "spec",
)


def load_own_packages() -> None:
    """Load our packages by their place, so that the user's `engine/` is not taken for ours.

    Their names are common words and Python searches the script's own folder first. Each holds a
    line of text; what is in them is loaded when it is used. Raises ImportError where a package
    of that name was loaded before.
    """
    base = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    for name in OWN_PACKAGES:
        place = os.path.join(base, name, "__init__.py")
        loaded = sys.modules.get(name)
        if loaded is not None:
            file = getattr(loaded, "__file__", None)
            if file is None or os.path.realpath(file) != os.path.realpath(place):
                raise ImportError(
                    f"modewright has a package `{name}`, but {file or 'a folder'} was loaded under "
                    "this name: import modewright first, or rename yours"
                )
            continue
        spec = spec_from_file_location(
            name, place, submodule_search_locations=[os.path.dirname(place)]
        )
        if spec is None or spec.loader is None:
            continue
        module = module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
