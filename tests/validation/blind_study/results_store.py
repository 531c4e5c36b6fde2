"""Kept: results of a plan in a store of a study, a block a case; none is diagnosed twice."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from modewright.workers import dask_entry_points as cluster_worker
from sweep.definition.measure import StoreColumn
from sweep.definition.study import Presentation
from sweep.execution.dask_address import Credentials, parse_address
from sweep.execution.dask_client import WorkerSetup, open_client
from sweep.store.digest import digest_of
from sweep.store.manifest import Manifest
from sweep.store.row import DONE, STOPPED, Block, Row
from sweep.store.store import Store, lock_folder, open_store
from tests.validation.blind_study.case_score import Answer
from tests.validation.blind_study.cases import Cases, Label, generate_cases
from tests.validation.blind_study.plan import Plan
from tests.validation.blind_study.result import Result, diagnose_case
from tests.validation.blind_study.result_transfer import export_results, import_results, rows_of
from tests.validation.evidence.evidence_store import CODE, ROOT, code_digest

Workers = Callable[[], AbstractContextManager[Executor]]
"""What diagnoses cases, while it is open."""
VARIED = (StoreColumn("strength", "real", ""), StoreColumn("rate", "real", "Hz"))
MEASURES = (
    StoreColumn("verdict", "text", ""),
    StoreColumn("cpu", "real", "s"),
    StoreColumn("compiler", "real", "s"),
    StoreColumn("wall", "real", "s"),
    StoreColumn("sindy", "text", ""),
    StoreColumn("free_gain", "text", ""),
)


@contextmanager
def threads(jobs: int) -> Iterator[Executor]:
    """Yield what diagnoses so many cases at a time on this machine, each in its process."""
    with ThreadPoolExecutor(jobs) as pool:
        yield pool


@contextmanager
def dask(cluster: str) -> Iterator[Executor]:
    """Yield the workers of a Dask cluster, which see this folder: `local:4`, `tls://head:8786`."""
    staff = WorkerSetup(cluster_worker.own_fingerprint, cluster_worker.__name__)
    with open_client(parse_address(cluster), Credentials(), staff) as client:
        yield client.get_executor(pure=False)


def diagnose_cases(
    plan: Plan,
    seed: int,
    workers: Workers,
    most: int | None,
    generator: str,
    carried: Path | None = None,
) -> list[Answer]:
    """Return what a diagnosis says of each case of a plan; what is missing is diagnosed now.

    A file of `carried` results counts as diagnosed where it is of the same code and cases.
    """
    cases = generate_cases(plan, seed, generator)
    known = cases.known(most)
    with lock_folder(_folder(plan, cases)):
        store = _store(plan, seed, cases)
        if carried and (count := import_results(store, plan.name, carried)):
            print(f"{plan.name}: {count} results of {carried.name}", flush=True)
        _fill(store, plan, cases, list(known.items()), seed, workers)
        rows = {row["scenario"]: row for row in rows_of(store)}
    return [_answer(rows[name], plan, label) for name, label in known.items()]


def export_study(study: Sequence[Plan], seed: int, generator: str, path: Path) -> int:
    """Write all results of a study so far to one Parquet file; return how many there are."""
    stores = {
        plan.name: _store(plan, seed, generate_cases(plan, seed, generator)) for plan in study
    }
    return export_results(stores, path)


def _store(plan: Plan, seed: int, cases: Cases) -> Store:
    return open_store(_folder(plan, cases), _manifest(plan, seed, cases))


def _answer(row: Mapping[str, Any], plan: Plan, label: Label) -> Answer:
    simpler = {name: row[name] for name in ("sindy", "free_gain")}
    verdict, took = _verdict(row["verdict"]), row["cpu"]
    return Answer(row["scenario"], plan.name, label, verdict, took, simpler, row["compiler"])


def _folder(plan: Plan, cases: Cases) -> Path:
    return ROOT / "build" / "proof" / _digest()[:16] / cases.folder.name / plan.name


def _verdict(text: str) -> dict[str, object]:
    found: dict[str, object] = json.loads(text or "{}")
    return found


def _digest() -> str:
    return code_digest((*CODE, "diagnosis"))


def _manifest(plan: Plan, seed: int, cases: Cases) -> Manifest:
    """Return of what the results are: of the code, the seed, and the sealed labels."""
    identity = {
        "code": _digest(),
        "seed": str(seed),
        "labels": cases.seal,
        "plan": repr(plan),
        "kept": repr(MEASURES),
    }
    count = len(cases.known())
    return Manifest(
        f"diagnosis_{plan.name}", digest_of(identity), identity, count, 1,
        VARIED, {}, MEASURES, Presentation(by=("variant", "strength", "rate")),
    )  # fmt: skip


def _fill(
    store: Store,
    plan: Plan,
    cases: Cases,
    known: list[tuple[str, Label]],
    seed: int,
    workers: Workers,
) -> None:
    """Diagnose the cases that the store does not have, some at a time, and keep each."""
    finished = store.finished_starts()
    missing = [number for number in range(len(known)) if number not in finished]
    if not missing:
        return
    with workers() as pool:
        work = {pool.submit(partial(_row, plan, cases, *known[n], n, seed)): n for n in missing}
        try:
            for done, future in enumerate(as_completed(work), 1):
                row = future.result()
                store.write_rows(Block(row.number, row.number + 1), [row])
                _tell(plan, known[row.number][1], row, f"{done} of {len(work)}")
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _row(plan: Plan, cases: Cases, name: str, label: Label, number: int, seed: int) -> Row:
    own = tuple(effect["id"] for effect in label["effects"]) if plan.without_own else ()
    result: Result = diagnose_case(cases.folder / name, own, plan.is_compared)
    return Row(
        number=number, variant=plan.name, scenario=name, sample=0, replicate=0, seed=seed,
        values={"strength": plan.strength, "rate": float(label["rate_Hz"])},
        status=DONE if result.verdict else STOPPED, message=result.message,
        measures={"verdict": result.verdict, "cpu": result.cpu_s,
                  "compiler": result.compiler_s, "wall": result.wall_s,
                  "sindy": result.sindy, "free_gain": result.free_gain},
    )  # fmt: skip


def _tell(plan: Plan, label: Label, row: Row, progress: str) -> None:
    answer = _answer({"scenario": row.scenario, **row.measures}, plan, label)
    cpu = f"{row.measures['cpu']:.1f} CPU s"
    said = row.message or answer.said
    print(
        f"{plan.name} {progress}: {row.values['rate']:g} Hz, {answer.true}: {said}, {cpu}",
        flush=True,
    )
