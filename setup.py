"""Setup: the packages of the wheel are found in the tree, see tools/build_wheel.py."""

import sys
from pathlib import Path

from setuptools import setup

ROOT = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT / "tools"))

from build_wheel import setup_arguments  # noqa: E402

setup(**setup_arguments(ROOT))
