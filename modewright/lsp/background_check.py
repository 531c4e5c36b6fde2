"""Background check: run the slow checks of a text in a process that is killed if the text changes.

The process reads a request with file and texts from stdin and writes diagnostics to stdout.
"""

from __future__ import annotations

import asyncio
import json
import sys
from pathlib import Path

from lsprotocol import converters, types

from modewright.api.spec_check import check_spec
from modewright.lsp.diagnostics import to_diagnostics
from modewright.lsp.workspace import Workspace


async def run_background_check(workspace: Workspace, path: Path) -> list[types.Diagnostic] | None:
    """Return all problems of a file, also those of slow checks, computed in a new process.

    The process gets the open texts of the workspace. None if it failed; its stderr is discarded.
    Cancellation kills it.
    """
    request = {
        "path": str(path),
        "root": str(workspace.root),
        "encoding": workspace.encoding,
        "texts": {str(file): text for file, text in workspace.texts.items()},
    }
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-P", "-m", "modewright.lsp.background_check"),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
    )
    try:
        answer, _ = await process.communicate(json.dumps(request).encode())
    finally:
        if process.returncode is None:
            process.kill()
    if process.returncode:
        return None
    converter = converters.get_converter()
    return [converter.structure(each, types.Diagnostic) for each in json.loads(answer)]


def main() -> None:
    """Read one request (path, root, encoding, texts) as JSON and print its diagnostics as JSON."""
    request = json.loads(sys.stdin.read())
    texts = {Path(file): text for file, text in request["texts"].items()}
    path = Path(request["path"])
    diagnostics = to_diagnostics(
        check_spec(str(path), Path(request["root"]), texts), path, request["encoding"]
    )
    converter = converters.get_converter()
    print(json.dumps([converter.unstructure(each) for each in diagnostics]))


if __name__ == "__main__":
    main()
