"""A cluster computes what a process computes; workers may die, join and leave."""

from __future__ import annotations

import dataclasses
import functools
import queue
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from distributed import Client, KilledWorker, LocalCluster, Security
from distributed.scheduler import WorkerState
from hypothesis import HealthCheck, given, settings, strategies as st

from sweep.address import Address, Credentials, address_of
from sweep.block import Block
from sweep.cluster import IN_FLIGHT, Cluster
from sweep.cluster_error import ClusterError
from sweep.cluster_worker import Answer, answer, packed
from sweep.clustering import NOWHERE, Staff, connected
from sweep.fingerprint import differences, fingerprint
from sweep.processes import WorkerError
from sweep.study_run import run_study
from tests.sweep.killing import broken, deadly, older, own, quickly
from tests.sweep.laying import QUICK, content, quick, study
from tests.sweep.test_study_run import bytes_of

STAFF = Staff(own)
NONE = Credentials()
PEM = ("cert", "key")


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    """Two processes; the first death of a worker is told of all blocks that it had."""
    with connected(Address(count=2), NONE, STAFF, deaths=1) as found:
        yield found


def test_real_workers_keep_the_bytes_of_this_process(tmp_path: Path, client: Client) -> None:
    made = study()
    run_study(made, tmp_path / "here", QUICK, block=7)
    found = run_study(made, tmp_path / "there", Cluster(client, quickly), block=7)
    assert (found.computed, found.lost) == (60, ())
    assert bytes_of(tmp_path / "there") == bytes_of(tmp_path / "here")


def test_who_dies_is_survived_and_what_workers_die_of_is_told(
    tmp_path: Path, client: Client
) -> None:
    """The others that such a worker had are computed again alone, and are not to blame."""
    made = study()
    run_study(made, tmp_path / "here", QUICK, block=10)
    task = functools.partial(deadly, tmp_path / "mark")
    found = run_study(made, tmp_path / "there", Cluster(client, task), block=10)
    assert (tmp_path / "mark").exists()
    assert [block for block, _ in found.lost] == [Block(40, 50)]
    assert found.lost[0][1] == "1 worker died while it was computed alone"
    assert found.computed == 50
    again = run_study(made, tmp_path / "there", Cluster(client, quickly))
    assert (again.before, again.computed) == (50, 10)
    assert bytes_of(tmp_path / "there") == bytes_of(tmp_path / "here")


def test_a_defect_in_a_worker_ends_the_run_with_its_traceback(
    tmp_path: Path, client: Client
) -> None:
    with pytest.raises(WorkerError, match="ZeroDivisionError: of our own"):
        run_study(study(), tmp_path, Cluster(client, broken))


def test_a_run_that_is_closed_leaves_a_store_to_go_on_with(tmp_path: Path, client: Client) -> None:
    made = study()
    run_study(made, tmp_path / "here", QUICK, block=4)

    def interrupt(done: int, before: int, total: int) -> None:
        if done >= 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(made, tmp_path / "there", Cluster(client, quickly), 4, interrupt)
    again = run_study(made, tmp_path / "there", Cluster(client, quickly))
    assert (again.before, again.computed) == (20, 40)
    assert bytes_of(tmp_path / "there") == bytes_of(tmp_path / "here")


# Who is asked, and who may answer.


def test_workers_with_other_code_are_refused_before_a_store_is_made(client: Client) -> None:
    address = Address(url=client.scheduler.address)
    with (
        pytest.raises(ClusterError, match=r"has other code: modewright 000000000000 instead of "),
        connected(address, NONE, Staff(older)),
    ):
        pass


def test_a_worker_looks_at_its_code_before_it_looks_at_the_study() -> None:
    wanted = {**fingerprint(), "numpy": "0.1"}
    told = answer(wanted, b"no study", Block(0, 1), quick)
    assert told.refusal == f"has other code: numpy {fingerprint()['numpy']} instead of 0.1"
    assert "Error" in answer(fingerprint(), b"no study", Block(0, 1), quick).defect
    assert differences(fingerprint(), fingerprint()) == ""


def test_a_worker_that_makes_another_program_of_the_study_computes_nothing() -> None:
    made = study()
    name = next(name for name in made.identity if name.startswith("Program"))
    other = dataclasses.replace(made, identity={**made.identity, name: "0" * 64})
    told = answer(fingerprint(), packed(other), Block(0, 1), quick)
    assert told == Answer(refusal=f"makes another {name}")


def test_a_scheduler_that_nobody_answers_for_is_told() -> None:
    with (
        pytest.raises(ClusterError, match=r"tcp://127\.0\.0\.1:1: no scheduler answers"),
        connected(Address(url="tcp://127.0.0.1:1"), NONE, STAFF, seconds=0.5),
    ):
        pass


def test_a_scheduler_without_workers_is_told() -> None:
    with LocalCluster(n_workers=0, dashboard_address=NOWHERE) as empty:
        address = Address(url=empty.scheduler_address)
        with (
            pytest.raises(ClusterError, match=r"no worker has joined .* within 0\.2 s"),
            connected(address, NONE, STAFF, seconds=0.2),
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
        dashboard_address=NOWHERE,
    ) as here:  # fmt: skip
        address = address_of(here.scheduler_address)
        with connected(address, files, STAFF) as known:
            assert run_study(study(), tmp_path / "out", Cluster(known, quickly)).computed == 60
        text = tmp_path / "text.pem"
        text.write_text("no certificate")
        for wrong, told in (
            (NONE, "takes an authority"),
            (Credentials(text, text, text), "cannot"),
        ):
            with pytest.raises(ClusterError, match=told), connected(address, wrong, STAFF):
                pass


@pytest.mark.parametrize(
    ("text", "address", "is_open"),
    [
        ("local:4", Address(count=4), False),
        ("tcp://127.0.0.1:8786", Address(0, "tcp://127.0.0.1:8786", "127.0.0.1"), False),
        ("tcp://localhost:8786/", Address(0, "tcp://localhost:8786", "localhost"), False),
        ("tcp://[::1]:8786", Address(0, "tcp://[::1]:8786", "::1"), False),
        ("tcp://head.site:8786", Address(0, "tcp://head.site:8786", "head.site"), True),
        ("tcp://10.0.0.1:8786", Address(0, "tcp://10.0.0.1:8786", "10.0.0.1"), True),
        ("tls://head.site:8786", Address(0, "tls://head.site:8786", "head.site"), False),
    ],
)
def test_an_address_is_of_processes_here_or_of_a_scheduler(
    text: str, address: Address, is_open: bool
) -> None:
    assert address_of(text) == address
    assert address.is_open == is_open


@pytest.mark.parametrize(
    "text", ["", "local", "local:0", "local:-1", "head:8786", "tcp://head", "tcp://head:99999"]
)
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is no cluster: `local:4`"):
        address_of(text)


# Without processes: a client that answers in an order of its own.


class Desk:
    """Takes what a client is given, answers it in any order, and counts."""

    def __init__(self, order: Callable[[int], int], threads: int = 3, deadly: int = -1) -> None:
        self.order, self.threads, self.deadly = order, threads, deadly
        self.most = 0
        self.waiting: list[tuple[Reply, Callable[[], Any]]] = []
        self.status = "running"

    def nthreads(self) -> dict[str, int]:
        return {"worker": self.threads}

    def submit(self, function: Any, *arguments: Any, pure: bool) -> Reply:
        reply = Reply(self)
        if function is bytes:
            reply.set_result(arguments[0])
            return reply
        wanted, held, start, stop = arguments
        self.waiting.append(
            (reply, lambda: self._answer(function, wanted, held.result(), start, stop))
        )
        self.most = max(self.most, len(self.waiting))
        return reply

    def cancel(self, replies: Any, force: bool) -> None:
        self.waiting.clear()

    def _answer(self, task: Any, wanted: Mapping[str, str], held: bytes, *ends: int) -> Answer:
        if ends[0] == self.deadly:
            raise KilledWorker("block", _worker(), 2)
        found: Answer = task(wanted, held, *ends)
        return found

    def turn(self) -> None:
        """Answer one of those that wait."""
        reply, work = self.waiting.pop(self.order(len(self.waiting)))
        try:
            reply.set_result(work())
        except KilledWorker as error:
            reply.set_exception(error)


class Reply(Future[Any]):
    """A future whose desk answers when somebody waits."""

    def __init__(self, desk: Desk) -> None:
        super().__init__()
        self.desk = desk


def _worker() -> WorkerState:
    return WorkerState(
        address="tcp://127.0.0.1:1", status="running", pid=1, name="w", nthreads=1,
        memory_limit=1, local_directory="", nanny="", server_id="w", services={}, versions={},
        extra={}, scheduler=None,
    )  # fmt: skip


class Turning(queue.SimpleQueue):  # type: ignore[type-arg]
    """A queue that lets its desk answer when it is empty."""

    desk: Desk

    def get(self, block: bool = True, timeout: float | None = None) -> Any:
        if self.empty() and self.desk.waiting:
            self.desk.turn()
        return super().get(block=False)


def cluster_of(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> Cluster:
    kind = type("Turned", (Turning,), {"desk": desk})
    monkeypatch.setattr("sweep.cluster.SimpleQueue", kind)
    return Cluster(desk, quickly)


@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(size=st.integers(1, 60), threads=st.integers(1, 9), seed=st.randoms(use_true_random=False))
def test_rows_depend_on_no_worker_no_block_size_and_no_order(
    tmp_path_factory: pytest.TempPathFactory, size: int, threads: int, seed: Any
) -> None:
    made, folder = study(), tmp_path_factory.mktemp("any")
    desk = Desk(lambda count: seed.randrange(count), threads)
    with pytest.MonkeyPatch.context() as patch:
        found = run_study(made, folder / "there", cluster_of(desk, patch), block=size)
    assert content(found.store) == content(run_study(made, folder / "here", QUICK).store)
    assert desk.most <= IN_FLIGHT * threads


def test_only_so_many_blocks_are_under_way(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = 0

    def blocks() -> Iterator[Block]:
        nonlocal taken
        for start in range(60):
            taken = start + 1
            yield Block(start, start + 1)

    desk = Desk(lambda count: 0, threads=2)
    for done, finished in enumerate(cluster_of(desk, monkeypatch)(study(), blocks()), start=1):
        assert finished.file
        assert taken <= done + IN_FLIGHT * desk.threads
    assert taken == 60


def test_a_block_is_to_blame_only_where_it_is_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(lambda count: 0, deadly=2)
    blocks = [Block(k, k + 1) for k in range(5)]
    found = list(cluster_of(desk, monkeypatch)(study(), blocks))
    assert [each.block.start for each in found] == [0, 1, 3, 4, 2]
    assert [each.lost for each in found if each.lost] == [
        "3 workers died while it was computed alone"
    ]


def test_a_cluster_whose_workers_are_all_gone_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sweep.cluster.LOOK", 0.0)
    desk = Desk(lambda count: 0, threads=0)
    with pytest.raises(ClusterError, match="no worker any more for 0 s"):
        list(
            dataclasses.replace(cluster_of(desk, monkeypatch), patience=0.0)(study(), [Block(0, 1)])
        )


def test_dask_is_loaded_by_no_other_executor() -> None:
    code = "import modewright.studies, sys; print([n for n in sys.modules if n in "
    code += "('distributed', 'dask')])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
