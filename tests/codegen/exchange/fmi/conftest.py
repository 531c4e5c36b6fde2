"""FMUs of shipped automata, each packed once, and tapes of what the engine did."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest

from codegen.exchange.fmi.archive import build_fmu
from codegen.exchange.fmi.variable import VERSIONS, Version
from lockstep.tick_log import TickLog
from modewright.api.simulation import program
from tests.codegen.exchange.fmi.importer import Importer, UnpackedFmu, unpack_fmu
from tests.codegen.target.closed_loop import record_driveline, record_supervisor

Ready = Callable[[str, Version], UnpackedFmu]


@pytest.fixture(params=VERSIONS, ids=lambda version: f"fmi{version}")
def version(request: pytest.FixtureRequest) -> Version:
    """Each version of FMI."""
    found: Version = request.param
    return found


@pytest.fixture(scope="session")
def ready(tapes: dict[str, TickLog], tmp_path_factory: pytest.TempPathFactory) -> Ready:
    """Return the FMU of an automaton, compiled and unpacked; of a tape's Program if it has one."""
    folder = tmp_path_factory.mktemp("fmi")

    @cache
    def made(name: str, version: Version) -> UnpackedFmu:
        place: Path = folder / f"{name}_{version}"
        used = tapes[name].program if name in tapes else program(name)
        return unpack_fmu(build_fmu(used, version), place, version)

    return made


@pytest.fixture(scope="session")
def tapes() -> dict[str, TickLog]:
    """What the engine read and carried: the driveline and its estimators, the supervisor."""
    found = record_driveline("float64", Fraction(21, 10), ["plant", "est"])
    single = record_driveline("float32", Fraction(1), ["est"])
    return {
        "estimator": found["est"],
        "driveline": found["plant"],
        "estimator_float32": single["est"],
        "supervisor": record_supervisor("float32", Fraction(21))["sup"],
    }


@pytest.fixture
def importer(version: Version, ready: Ready) -> Iterator[Importer]:
    """An instance of the estimator before initialization mode."""
    made = Importer(ready("estimator", version))
    yield made
    made.close()


@pytest.fixture
def stepping(importer: Importer) -> Importer:
    """The same after initialization mode."""
    importer.start({"y_em": 81.0, "y_w": 10.0}, stop=1.0)
    return importer
