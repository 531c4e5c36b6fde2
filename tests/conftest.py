"""Options, fixtures and hypothesis profiles of all tests."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
import typer
from hypothesis import settings

from language.loading import load
from language.programs import connection_program, sensor_program
from modewright.runtime.gc_threshold import raise_gc_threshold
from tests.support.memoised_specs import memoise_lowering, memoise_shipped
from tests.support.valid_lowering import require_valid_result

for module, function in (
    (load, "lower_sampled_automaton"),
    (load, "lower_continuous_automaton"),
    (connection_program, "formula_program"),
    (sensor_program, "formula_program"),
):
    setattr(module, function, require_valid_result(getattr(module, function)))
load.program_of = memoise_lowering(load.program_of)  # before it is imported by name
from modewright.api import simulation as api  # noqa: E402

for name in ("load", "program"):
    setattr(api, name, memoise_shipped(getattr(api, name)))
settings.register_profile("ci", derandomize=True, max_examples=30, deadline=None)
settings.register_profile("verify", max_examples=1000, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


for number in (signal.SIGINT, signal.SIGHUP):
    # A process in the background (nohup, a job of a script) ignores these, and so would its
    # children, to which tests send them.
    with suppress(ValueError):  # not in the main thread
        if signal.getsignal(number) == signal.SIG_IGN:
            is_interrupt = number == signal.SIGINT
            signal.signal(number, signal.default_int_handler if is_interrupt else signal.SIG_DFL)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add our options to pytest."""
    parser.addoption("--update", action="store_true", help="rewrite golden files")
    parser.addoption("--recordings", default=None, help="folder of the real recordings")


def pytest_collection_finish() -> None:
    """Leave what was imported out of every later search for garbage."""
    gc.collect()
    gc.freeze()
    raise_gc_threshold()


def pytest_sessionfinish() -> None:
    """Look for garbage once more: pytest does five times, which finds nothing then."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep compiled programs in a folder of the tests, one for all workers, not in the home."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "cache"
    folder.mkdir(mode=0o700, exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MODEWRIGHT_CACHE", str(folder))
        yield


@pytest.fixture(scope="session", autouse=True)
def _commands_are_made_once() -> Iterator[None]:
    """A command line looks at the parameters of its thirty commands when it is called."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.main, "get_command", cache(typer.main.get_command))
        yield


@pytest.fixture
def update(request: pytest.FixtureRequest) -> bool:
    """Tell whether golden files are to be rewritten."""
    return bool(request.config.getoption("--update"))


@pytest.fixture
def recordings(request: pytest.FixtureRequest) -> Path:
    """Return the folder of the real recordings; the test is skipped where there is none."""
    named = request.config.getoption("--recordings") or os.environ.get("MODEWRIGHT_RECORDINGS")
    if not named:
        pytest.skip("no recordings: give --recordings DIR or MODEWRIGHT_RECORDINGS")
    return Path(str(named))
