"""Studies: run the variants of a study into a folder, summarise and plot the results."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from language.overlays.expand_document import Project, read_document
from language.text.arguments import PathText, optional, to_count, to_path, to_project, to_text
from language.text.diagnostic import MissingToolError, Problems, render_problem, sort_problems
from language.text.document import ScalarNode
from modewright.api.documents import Values, parse_values
from modewright.runtime.back_end_choice import run_block
from modewright.runtime.output_files import OutputError
from sweep.analysis.summary import Summary, summary_of
from sweep.definition.override_check import require_overridable
from sweep.definition.sampling_reader import find_imbalance
from sweep.definition.study import Study
from sweep.definition.study_reader import read_study
from sweep.execution import fork_server
from sweep.execution.dask_address import Address, Credentials, parse_address
from sweep.execution.executor import Executor, SerialExecutor
from sweep.execution.prepare_study import prepare_study, resample_study
from sweep.execution.process_executor import ProcessExecutor
from sweep.execution.study_run import Progress, StudyRun, Warn, run_study
from sweep.store.store import read_store

if TYPE_CHECKING:
    from engine.results.plot import Picture
    from sweep.analysis.sensitivity import Sensitivity

WORKER_COMMAND = (sys.executable, "-P", "-m", "modewright.workers.study_worker")
"""The command that starts a worker process."""

TEMPLATE_MODULE = "modewright.workers.preloaded_modules"
"""The module that the fork server loads for the workers of a local cluster."""


def sweep(
    study: PathText,
    out: PathText,
    values: Values | None = None,
    root: PathText | None = None,
    *,
    workers: int | None = None,
    block: int | None = None,
    samples: int | None = None,
    seed: int | None = None,
    progress: Progress | None = None,
    warn: Warn | None = None,
    executor: Executor | None = None,
    cluster: str | None = None,
    credentials: Credentials | None = None,
) -> StudyRun:
    """Run a study into the folder `out`, or continue it there; finished blocks are always kept.

    `values` are parameter values that the study does not set. `workers` is the number of processes
    (default: all cores; 1: this process); `executor` replaces them. `cluster` is `local:4` or the
    address of a Dask scheduler, with `credentials` for TLS, and takes precedence. `block` is the
    number of variants that are stored at once; `samples` and `seed` replace those of the study.
    `progress` is called with the finished variants. `warn` is called with warnings of the study and
    with damaged blocks; by default these are Python warnings. Raises SpecError, ValueError,
    ClusterError, MissingToolError and OutputError.
    """
    name, folder, project = to_text(study, "study"), to_path(out, "out"), to_project(root)
    scalars, cluster = parse_values(values), optional(to_text, cluster, "cluster")
    count, block = optional(to_count, workers, "workers"), optional(to_count, block, "block")
    samples, seed = optional(to_count, samples, "samples"), optional(to_count, seed, "seed")
    place = parse_address(cluster) if cluster else None
    if place and place.count:
        fork_server.start_fork_server(TEMPLATE_MODULE)
    if block is not None and block < 1:
        raise ValueError(f"blocks of {block} variants are none")
    tell = warn or warnings.warn
    found = _read_study(name, scalars, project, tell)
    ready = prepare_study(_override_sampling(found, samples, seed, tell))
    try:
        if place is None:
            return run_study(
                ready, folder, executor or _local_executor(count), block, progress, tell
            )
        with _cluster_executor(place, credentials or Credentials()) as remote:
            return run_study(ready, folder, remote, block, progress, tell)
    except OSError as error:
        where = f" {error.filename}" if error.filename else ""
        raise OutputError(f"{folder}: cannot write{where}: {error.strerror}") from None


def _local_executor(workers: int | None) -> Executor:
    """Return the executor for a number of processes, by default one for each core."""
    count = workers or os.cpu_count() or 1
    return ProcessExecutor(count, WORKER_COMMAND) if count > 1 else SerialExecutor(run_block)


def _read_study(
    study: str, values: Mapping[str, ScalarNode], project: Project, warn: Warn
) -> Study:
    """Return a study with values of the command line; passes its warnings to `warn`.

    Raises SpecError, and ValueError for a value of a parameter that the study sets.
    """
    document = read_document(project.path_of(study))
    problems = Problems()
    result = read_study(document, project, values, problems)
    require_overridable(result, values)
    for problem in sort_problems(dict.fromkeys(problems.reported)):
        warn(render_problem(problem))
    return result


def _override_sampling(study: Study, samples: int | None, seed: int | None, warn: Warn) -> Study:
    """Return a study with another number of samples or seed; warns of an unbalanced number."""
    result = resample_study(study, samples, seed)
    fault = find_imbalance(result.sampling.method, samples) if samples is not None else None
    if fault:
        warn(f"{fault[0]}; {fault[1]}")
    return result


@contextmanager
def _cluster_executor(place: Address, credentials: Credentials) -> Iterator[Executor]:
    """Yield the executor of a cluster whose workers have the same code. Raises ClusterError.

    Raises MissingToolError if the package `distributed` is not installed.
    """
    try:
        from sweep.execution.dask_client import WorkerSetup, open_client
        from sweep.execution.dask_executor import DaskExecutor
    except ImportError:
        advice = "pip install 'modewright[cluster]'"
        raise MissingToolError(f"a cluster needs the package `distributed`: {advice}") from None
    from modewright.workers import dask_entry_points as cluster_worker

    staff = WorkerSetup(cluster_worker.own_fingerprint, cluster_worker.__name__)
    with open_client(place, credentials, staff) as client:
        yield DaskExecutor(client, cluster_worker.compute_block)


def study_summary(out: PathText) -> Summary:
    """Return the summary of the results in the folder of a study, which may be incomplete.

    Nothing is simulated. Raises SpecError if the folder has no results or a damaged block, and
    MissingToolError without pyarrow.
    """
    return summary_of(read_store(to_path(out, "out")))


def study_pictures(out: PathText) -> dict[str, Picture]:
    """Return the plots that a study defines, by name, from the results in its folder.

    No file is written. Raises SpecError if the folder has no results or a damaged block, and
    MissingToolError without pyarrow.
    """
    from sweep.analysis.plots import draw_pictures

    return draw_pictures(read_store(to_path(out, "out")))


def sensitivity(out: PathText) -> Sensitivity:
    """Return the sensitivity indices of the random variables of a study, from its stored results.

    Only finished variants count. Raises SpecError if the study was not sampled by `saltelli` or
    `morris` and if the folder has no results or a damaged block; MissingToolError without pyarrow.
    """
    from sweep.analysis.sensitivity import sensitivity_of

    return sensitivity_of(read_store(to_path(out, "out")))
