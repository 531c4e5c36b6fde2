"""Workers of this machine are copies of one process, which takes nothing from the user's folder."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ASKED = """
import os
import modewright
from modewright.api.studies import TEMPLATE_MODULE
from sweep.execution import fork_server

def main():
    environment = dict(os.environ)
    fork_server.start_fork_server(TEMPLATE_MODULE)
    assert environment == dict(os.environ), "its environment is not ours"
    from sweep.execution.dask_address import Address, Credentials
    from sweep.execution.dask_client import WorkerSetup, open_client
    staff = WorkerSetup(modewright.workers.dask_entry_points.own_fingerprint)
    with open_client(Address(count=2), Credentials(), staff) as client:
        told = client.run(lambda: (os.getppid(), "engine.batch.compiled_batch" in sys.modules))
    parents, loaded = zip(*told.values())
    print(len(told), len(set(parents)), all(loaded))

if __name__ == "__main__":
    import sys
    import modewright.workers.dask_entry_points
    main()
"""


@pytest.mark.long
def test_workers_are_copies_of_one_process_that_has_loaded_our_code(tmp_path: Path) -> None:
    script, folder = tmp_path / "script" / "asked.py", tmp_path / "user"
    script.parent.mkdir()
    script.write_text(ASKED)
    for hidden in ("distributed", "engine", "numpy", "modewright"):
        (folder / hidden).mkdir(parents=True)
        (folder / hidden / "__init__.py").write_text("raise SystemExit('the file of a user')\n")
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONSAFEPATH"}
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.stdout == "2 1 True\n", done.stderr
