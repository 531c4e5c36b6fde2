"""Entry point of `python -m modewright`: run the command line."""

import os
import sys

# With -m Python imports from the working folder first, where a user's `typer.py` may be. Remove
# that folder, as for the command `modewright`, unless it contains this package.
HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
if not sys.flags.safe_path and sys.path and os.path.realpath(sys.path[0]) != os.path.realpath(HERE):
    del sys.path[0]

from modewright.cli.app import main  # noqa: E402

main()
