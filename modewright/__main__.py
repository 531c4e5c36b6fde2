"""Main: `python -m modewright` is the command line."""

import os
import sys

# With -m Python looks into the working folder first, where a user's `typer.py` may lie; the command
# `modewright` does not look there. The folder stays only if we are in it.
HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
if not sys.flags.safe_path and sys.path and os.path.realpath(sys.path[0]) != os.path.realpath(HERE):
    del sys.path[0]

from modewright.cli.app import main  # noqa: E402

main()
