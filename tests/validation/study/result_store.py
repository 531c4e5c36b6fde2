"""Result store: the results of a group, a block for each case; no case is diagnosed twice.

A result depends on the code of the product, on the labels and on the group.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any

from sweep.definition.measure import StoreColumn
from sweep.definition.study import Presentation
from sweep.store.digest import digest_of
from sweep.store.manifest import Manifest
from sweep.store.row import DONE, STOPPED, Block, Row
from sweep.store.store import Store, lock_folder, open_store
from tests.validation.evidence.evidence_store import CODE, code_digest
from tests.validation.study.accepted_names import right_names
from tests.validation.study.case_score import Answer
from tests.validation.study.cases import FOLDER, Cases, Label, generate_cases
from tests.validation.study.generator_table import COMPARED, Generator, Group
from tests.validation.study.isolated_process import diagnose_case
from tests.validation.study.result_transfer import export_results, import_results, rows_of

VARIED = (StoreColumn("strength", "real", ""), StoreColumn("rate", "real", "Hz"))
MEASURES = (
    StoreColumn("label", "text", ""),
    StoreColumn("verdict", "text", ""),
    StoreColumn("decision", "text", ""),
    StoreColumn("simpler", "text", ""),
    StoreColumn("cpu", "real", "s"),
    StoreColumn("compiler", "real", "s"),
    StoreColumn("wall", "real", "s"),
)
LABEL_KEYS = ("effects", "strength", "base", "visibility", "machine")
"""What is kept of a label."""


def diagnose_group(
    generator: Generator, group: Group, jobs: int, share: float = 1.0, carried: Path | None = None
) -> list[Answer]:
    """Return the answers to the first cases of a group, for a share of all.

    Missing results are computed now, `jobs` at a time. Results in the file `carried` count if code,
    labels and group are the same.
    """
    cases = generate_cases(generator, group)
    known = cases.known(share)
    with lock_folder(_folder(group, cases)):
        store = _open(group, cases)
        if carried and (count := import_results(store, group.key, carried)):
            print(f"{group.key}: {count} results of {carried.name}", flush=True)
        _fill(store, generator, group, cases, list(known.items()), jobs)
        rows = {row["scenario"]: row for row in rows_of(store)}
    return [answer_of(rows[name]) for name in known]


def export_groups(every: Iterable[Generator], path: Path) -> int:
    """Write the results of generators to a Parquet file; return how many it has (see there)."""
    stores = {
        group.key: _open(group, generate_cases(generator, group))
        for generator in every
        for group in generator.groups
    }
    return export_results(stores, path, product_digest())


def answer_of(row: Mapping[str, Any]) -> Answer:
    """Return the answer that a row of a store or of an exported file contains."""
    generator, _, group = row["variant"].partition("/")
    label, verdict, decision, simpler = (
        json.loads(row[name]) for name in ("label", "verdict", "decision", "simpler")
    )
    case, cpu, message = row["scenario"], row["cpu"], row["message"]
    return Answer(generator, group, case, label, verdict, cpu, decision, simpler, message)


def _folder(group: Group, cases: Cases) -> Path:
    return FOLDER / "results" / product_digest()[:16] / cases.folder.name / group.name


def product_digest() -> str:
    """Return the digest of all code and specs that a diagnosis depends on."""
    return code_digest((*CODE, "diagnosis"))


def _open(group: Group, cases: Cases) -> Store:
    return open_store(_folder(group, cases), _manifest(group, cases))


def _manifest(group: Group, cases: Cases) -> Manifest:
    """Return what the results depend on: code, labels, group and stored columns."""
    identity = {
        "code": product_digest(),
        "seed": str(group.seed),
        "labels": cases.digest,
        "group": repr(group),
        "kept": repr(MEASURES),
    }
    return Manifest(
        f"diagnosis_{group.name}", digest_of(identity), identity, len(cases.known()), 1,
        VARIED, {}, MEASURES, Presentation(by=("variant", "strength", "rate")),
    )  # fmt: skip


def _fill(
    store: Store,
    generator: Generator,
    group: Group,
    cases: Cases,
    known: list[tuple[str, Label]],
    jobs: int,
) -> None:
    """Diagnose the cases that the store does not have, `jobs` at a time, and store each."""
    finished = store.finished_starts()
    missing = [number for number in range(len(known)) if number not in finished]
    if not missing:
        return
    with ThreadPoolExecutor(jobs) as pool:
        diagnose = partial(_diagnose, generator, group, cases)
        work = [pool.submit(diagnose, number, *known[number]) for number in missing]
        try:
            for done, future in enumerate(as_completed(work), 1):
                row = future.result()
                store.write_rows(Block(row.number, row.number + 1), [row])
                _print_row(group, row, f"{done} of {len(work)}")
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _diagnose(
    generator: Generator, group: Group, cases: Cases, number: int, name: str, label: Label
) -> Row:
    """Return the row of one case."""
    own: set[str] = set()
    for effect in label["effects"] if group.without_own else ():
        own |= right_names(generator.name, effect["id"])
    with_baselines = generator.is_compared and group.name in COMPARED
    result = diagnose_case(cases.folder / name, generator.spec, tuple(sorted(own)), with_baselines)
    rate = label["rate_Hz"] if "rate_Hz" in label else label["rate_hz"]
    kept = {key: label[key] for key in LABEL_KEYS if key in label}
    texts = {
        "label": kept,
        "verdict": result.verdict,
        "decision": result.decision,
        "simpler": result.simpler,
    }
    return Row(
        number=number, variant=group.key, scenario=name, sample=0, replicate=0, seed=group.seed,
        values={"strength": group.strength, "rate": float(rate)},
        status=DONE if result.verdict else STOPPED, message=result.message,
        measures={**{key: json.dumps(value) for key, value in texts.items()},
                  "cpu": result.cpu_s, "compiler": result.compiler_s, "wall": result.wall_s},
    )  # fmt: skip


def _print_row(group: Group, row: Row, progress: str) -> None:
    cells = {"variant": row.variant, "scenario": row.scenario, "message": row.message}
    answer = answer_of({**cells, **row.measures})
    said = row.message or answer.said
    rate, cpu = row.values["rate"], f"{answer.cpu_s:.1f} CPU s"
    print(f"{group.key} {progress}: {rate:g} Hz, {answer.true}: {said}, {cpu}", flush=True)
