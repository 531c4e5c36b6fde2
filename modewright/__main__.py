"""Main: `python -m modewright` is the command line."""

from modewright.cli import main

main()
