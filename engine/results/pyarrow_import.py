"""Import of pyarrow with its Parquet module, an optional dependency."""

from __future__ import annotations

from types import ModuleType

from language.text.diagnostic import MissingToolError


def import_pyarrow(feature: str, hint: str = "") -> ModuleType:
    """Return pyarrow with its Parquet module loaded.

    Raises MissingToolError if it is not installed; the text begins with `feature`, which needs it,
    and ends with `hint`.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingToolError(
            f"{feature} needs the package `pyarrow`: pip install 'modewright[parquet]'{hint}"
        ) from None
    module: ModuleType = pyarrow
    return module
