"""Loading: the functions of a predictor's library, with what they take."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any


def load_predictor_library(path: Path) -> Any:
    """Return the library of a predictor (codegen/templates/predictor.c.jinja)."""
    library = ctypes.CDLL(str(path))
    pointer, whole = ctypes.c_void_p, ctypes.c_long
    library.modewright_differences.argtypes = [
        *(pointer, pointer, ctypes.c_int, whole),
        *(pointer, pointer, pointer, pointer, pointer, pointer),
    ]
    library.modewright_differences.restype = None
    library.modewright_predict.argtypes = [
        *(pointer, pointer, pointer, pointer, whole, pointer),
        *(whole, whole, ctypes.c_int, pointer, pointer, pointer, pointer, pointer),
    ]
    library.modewright_predict.restype = whole
    library.modewright_predict_all.argtypes = [
        *(pointer, pointer, pointer, pointer, whole, pointer, ctypes.c_int),
        *(whole, whole, pointer, pointer, whole),
        *(pointer, pointer, pointer, pointer, pointer),
    ]
    library.modewright_predict_all.restype = None
    library.modewright_squares.argtypes = [
        *(pointer, whole, pointer, pointer),
        *(pointer, pointer, pointer),
    ]
    library.modewright_squares.restype = None
    return library
