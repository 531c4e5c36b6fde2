"""Worker: the process that `modewright sweep` starts to compute blocks of a study."""

from __future__ import annotations

from modewright.runtime.compiled_run import run_block
from sweep.execution.worker import serve_blocks


def main() -> None:
    """Answer blocks until who started us is gone."""
    serve_blocks(run_block)


if __name__ == "__main__":
    main()
