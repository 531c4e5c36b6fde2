"""Study worker: the process that `modewright sweep` starts to compute blocks."""

from __future__ import annotations

from modewright.runtime.back_end_choice import run_block
from sweep.execution.worker import serve_blocks


def main() -> None:
    """Read a study and blocks from stdin and answer them on stdout until the input ends."""
    serve_blocks(run_block)


if __name__ == "__main__":
    main()
