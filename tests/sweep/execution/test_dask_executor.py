"""A cluster computes what a process computes; workers may die, join and leave."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from distributed import Client, LocalCluster, Security

from sweep.execution import dask_client as clustering, dask_executor as cluster
from sweep.execution.dask_address import Address, Credentials, parse_address
from sweep.execution.dask_client import DASHBOARD_ADDRESS, WorkerSetup, open_client
from sweep.execution.dask_error import ClusterError
from sweep.execution.dask_executor import DaskExecutor
from sweep.execution.dask_worker import Answer, answer_block, pack_study
from sweep.execution.fingerprint import describe_differences, fingerprint
from sweep.execution.process_executor import WorkerError
from sweep.execution.study_run import run_study
from sweep.store.row import Block
from tests.sweep.example_studies import QUICK_EXECUTOR, make_study, quick_results
from tests.sweep.execution.test_study_run import bytes_of
from tests.sweep.failing_workers import (
    answer_quickly,
    answer_with_defect,
    kill_every_holder,
    kill_first_holder,
    kill_worker_at_block,
    older_fingerprint,
    own_fingerprint,
)

pytestmark = pytest.mark.long

STAFF = WorkerSetup(own_fingerprint)
NONE = Credentials()
PEM = ("cert", "key")


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    """Two processes; the first death of a worker is told of all blocks that it had."""
    with open_client(Address(count=2), NONE, STAFF, max_deaths=1) as found:
        yield found


def test_real_workers_keep_the_bytes_of_this_process(tmp_path: Path, client: Client) -> None:
    made = make_study()
    run_study(made, tmp_path / "here", QUICK_EXECUTOR, block_size=7)
    found = run_study(made, tmp_path / "there", DaskExecutor(client, answer_quickly), block_size=7)
    assert (found.computed, found.lost_blocks) == (60, ())
    assert bytes_of(tmp_path / "there") == bytes_of(tmp_path / "here")


def test_who_dies_is_survived_and_what_workers_die_of_is_told(
    tmp_path: Path, client: Client
) -> None:
    """The others that such a worker had are computed again alone, and are not to blame."""
    made = make_study()
    run_study(made, tmp_path / "here", QUICK_EXECUTOR, block_size=10)
    task = functools.partial(kill_worker_at_block, tmp_path / "mark")
    found = run_study(made, tmp_path / "there", DaskExecutor(client, task), block_size=10)
    assert (tmp_path / "mark").exists()
    assert [block for block, _ in found.lost_blocks] == [Block(40, 50)]
    assert found.lost_blocks[0][1] == "1 worker died while it was computed alone"
    assert found.computed == 50
    again = run_study(made, tmp_path / "there", DaskExecutor(client, answer_quickly))
    assert (again.reused, again.computed) == (50, 10)
    assert bytes_of(tmp_path / "there") == bytes_of(tmp_path / "here")


def test_a_worker_that_dies_with_the_study_loses_no_block(
    tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It died of a block, or was killed: what is given to others again is the study, too."""
    made, mark = make_study(), tmp_path / "mark"
    run_study(made, tmp_path / "here", QUICK_EXECUTOR, block_size=10)
    monkeypatch.setattr(cluster, "PLACE_STUDY", functools.partial(kill_first_holder, mark))
    found = run_study(made, tmp_path / "there", DaskExecutor(client, answer_quickly), block_size=10)
    assert mark.exists()
    assert (found.computed, found.lost_blocks) == (60, ())
    assert bytes_of(tmp_path / "there") == bytes_of(tmp_path / "here")


def test_a_study_that_every_worker_dies_of_ends(
    tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "PLACE_STUDY", kill_every_holder)
    monkeypatch.setattr(cluster, "MAX_STUDY_DEATHS", 2)
    found = run_study(make_study(), tmp_path, DaskExecutor(client, answer_quickly), block_size=30)
    assert found.computed == 0
    assert {why for _, why in found.lost_blocks} == {"2 workers died that were given the study"}


def test_a_defect_in_a_worker_ends_the_run_with_its_traceback(
    tmp_path: Path, client: Client
) -> None:
    with pytest.raises(WorkerError, match="ZeroDivisionError: of our own"):
        run_study(make_study(), tmp_path, DaskExecutor(client, answer_with_defect))


def test_a_run_that_is_closed_leaves_a_store_to_go_on_with(tmp_path: Path, client: Client) -> None:
    made = make_study()
    run_study(made, tmp_path / "here", QUICK_EXECUTOR, block_size=4)

    def interrupt(done: int, before: int, total: int) -> None:
        if done >= 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(made, tmp_path / "there", DaskExecutor(client, answer_quickly), 4, interrupt)
    again = run_study(made, tmp_path / "there", DaskExecutor(client, answer_quickly))
    assert (again.reused, again.computed) == (20, 40)
    assert bytes_of(tmp_path / "there") == bytes_of(tmp_path / "here")


# Who is asked, and who may answer.


def test_workers_with_other_code_are_refused_before_a_store_is_made(client: Client) -> None:
    address = Address(url=client.scheduler.address)
    with (
        pytest.raises(ClusterError, match=r"has other code: modewright 000000000000 instead of "),
        open_client(address, NONE, WorkerSetup(older_fingerprint)),
    ):
        pass


@pytest.mark.parametrize(("failures", "answers"), [(3, True), (4, False)])
def test_a_scheduler_that_is_busy_with_another_client_is_asked_again(
    client: Client, monkeypatch: pytest.MonkeyPatch, failures: int, answers: bool
) -> None:
    """Dask's own assertion fails where a message to all clients comes with its first answer."""
    left = iter([True] * failures)

    def busy(*args: object, **options: object) -> Client:
        assert not next(left, False)
        return Client(*args, **options)

    monkeypatch.setattr(clustering, "Client", busy)
    address = Address(url=client.scheduler.address)
    expected = (
        contextlib.nullcontext() if answers else pytest.raises(ClusterError, match="asked 4 times")
    )
    with expected, open_client(address, NONE, STAFF) as found:
        assert found.scheduler.address == client.scheduler.address


def test_a_worker_looks_at_its_code_before_it_looks_at_the_study() -> None:
    wanted = {**fingerprint(), "numpy": "0.1"}
    told = answer_block(wanted, b"no study", Block(0, 1), quick_results)
    assert told.refusal == f"has other code: numpy {fingerprint()['numpy']} instead of 0.1"
    assert "Error" in answer_block(fingerprint(), b"no study", Block(0, 1), quick_results).defect
    assert describe_differences(fingerprint(), fingerprint()) == ""


def test_a_worker_that_makes_another_program_of_the_study_computes_nothing() -> None:
    made = make_study()
    name = next(name for name in made.identity if name.startswith("Program"))
    other = dataclasses.replace(made, identity={**made.identity, name: "0" * 64})
    told = answer_block(fingerprint(), pack_study(other), Block(0, 1), quick_results)
    assert told == Answer(refusal=f"makes another {name}")


def test_a_scheduler_that_nobody_answers_for_is_told() -> None:
    with (
        pytest.raises(ClusterError, match=r"tcp://127\.0\.0\.1:1: no scheduler answers"),
        open_client(Address(url="tcp://127.0.0.1:1"), NONE, STAFF, timeout=0.5),
    ):
        pass


def test_a_scheduler_without_workers_is_told() -> None:
    with LocalCluster(n_workers=0, dashboard_address=DASHBOARD_ADDRESS) as empty:
        address = Address(url=empty.scheduler_address)
        with (
            pytest.raises(ClusterError, match=r"no worker has joined .* within 0\.2 s"),
            open_client(address, NONE, STAFF, timeout=0.2),
        ):
            pass


def test_a_cluster_by_tls_takes_files_and_refuses_who_has_none(tmp_path: Path) -> None:
    if shutil.which("openssl") is None:
        pytest.skip("openssl makes the certificate of this test")
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=here"]
    command += ["-days", "2", "-keyout", str(key), "-out", str(certificate)]
    subprocess.run(command, check=True, capture_output=True)
    files = Credentials(certificate, certificate, key)
    roles = [f"tls_{role}_{what}" for role in ("scheduler", "worker", "client") for what in PEM]
    named = {role: str(key if role.endswith("key") else certificate) for role in roles}
    security = Security(tls_ca_file=str(certificate), require_encryption=True, **named)
    with LocalCluster(
        n_workers=1, processes=False, protocol="tls://", security=security,
        dashboard_address=DASHBOARD_ADDRESS,
    ) as here:  # fmt: skip
        address = parse_address(here.scheduler_address)
        with open_client(address, files, STAFF) as known:
            assert (
                run_study(
                    make_study(), tmp_path / "out", DaskExecutor(known, answer_quickly)
                ).computed
                == 60
            )
        text = tmp_path / "text.pem"
        text.write_text("no certificate")
        for wrong, told in (
            (NONE, "takes an authority"),
            (Credentials(text, text, text), "cannot"),
        ):
            with pytest.raises(ClusterError, match=told), open_client(address, wrong, STAFF):
                pass


def test_dask_is_loaded_by_no_other_executor() -> None:
    code = "import modewright.api.studies, sys; print([n for n in sys.modules if n in "
    code += "('distributed', 'dask')])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
