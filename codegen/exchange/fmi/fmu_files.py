"""FMU files: the files of an FMU: model description, sources, and headers of the standard."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from importlib import resources
from typing import Any

from codegen.emit.c_module import emit_c_files
from codegen.exchange.fmi.interface import used_enumerations, variables_of
from codegen.exchange.fmi.unit import unit_definitions
from codegen.exchange.fmi.unsupported_functions import unsupported_functions
from codegen.exchange.fmi.variable import FMI_TYPES, VERSIONS, Version
from codegen.toolchain.templates import product_version as product, render
from language.ir.printer import digest
from language.ir.program import Program

HEADERS: Mapping[Version, tuple[str, ...]] = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}
"""Headers of the Modelica Association, under their own licence (BSD, two clauses), by version."""
COMPILER_OPTIONS = "-ffp-contract=off -fno-fast-math"
"""Options that a compiler needs so that its code gives the same bits (rule C3)."""


def emit_fmu_files(program: Program, version: Version) -> dict[str, bytes]:
    """Return the files of an FMU without a binary, by their path in it, in sorted order.

    They are `modelDescription.xml` and, below `sources/`, the C files of the Program, the wrapper,
    the headers of the standard and (FMI 3 only) `buildDescription.xml`. Raises ValueError for an
    unknown version and for a Program without a block `step`.
    """
    if version not in VERSIONS:
        known = " and ".join(map(str, VERSIONS))
        raise ValueError(f"there is no FMI {version}: versions are {known}")
    sources = {**emit_c_files(program), **emit_wrapper(program, version)}
    c_files = sorted(name for name in sources if name.endswith(".c"))
    context = {**fmu_context(program, version), "sources": c_files}
    files = {f"sources/{name}": text.encode() for name, text in sources.items()}
    files |= {f"sources/{name}": data for name, data in read_headers(version).items()}
    files["modelDescription.xml"] = _render_bytes(f"fmi/description_{version}.xml.jinja", context)
    if version == 3:
        files["sources/buildDescription.xml"] = _render_bytes("fmi/build.xml.jinja", context)
    return dict(sorted(files.items()))


def emit_wrapper(program: Program, version: Version) -> dict[str, str]:
    """Return the C file that implements the functions of FMI, by its name `<program>_fmu.c`."""
    context = fmu_context(program, version)
    return {f"{program.name}_fmu.c": render(f"fmi/fmi_{version}.c.jinja", context)}


def read_headers(version: Version) -> dict[str, bytes]:
    """Return the contents of the headers of an FMI version by name, as in HEADERS."""
    folder = resources.files("codegen.exchange.fmi").joinpath("headers")
    return {name: folder.joinpath(name).read_bytes() for name in HEADERS[version]}


def instantiation_token(program: Program, version: Version) -> str:
    """Return the token that ties a description to its binary: a UUID of version 5 in braces.

    It is computed from the version of the product, the version of FMI, and the name and digest of
    the Program.
    """
    identity = f"modewright {product()} FMI {version} {program.name} {digest(program)}"
    return f"{{{uuid.uuid5(uuid.NAMESPACE_URL, identity)}}}"


def fmu_context(program: Program, version: Version) -> dict[str, Any]:
    """Return the context of the templates of an FMU.

    `period` is the period of the Program, or its major step if it is continuous, as the text of a
    float; `over` and `under` are its numerator and denominator. `variables` are numbered from 0 in
    the order of `variables_of`.
    """
    variables = variables_of(program, version)
    period = program.period or program.major_step
    return {
        "name": program.name,
        "version": product(),
        "fmi": f"fmi{version}",
        "token": instantiation_token(program, version),
        "digest": digest(program),
        "period": repr(float(period)),
        "over": f"{float(period.numerator)!r}",
        "under": f"{float(period.denominator)!r}",
        "variables": list(enumerate(variables)),
        "enumerations": used_enumerations(program, variables),
        "units": unit_definitions(variable.unit for variable in variables),
        "unknowns": [(k, v) for k, v in enumerate(variables) if v.causality == "output"],
        "types": FMI_TYPES[version],
        "stores": sorted({variable.kept for variable in variables} - {"fault"}),
        "written": sorted({variable.kept for variable in variables if variable.role != "SHOWN"}),
        "faults": program.faults,
        "options": COMPILER_OPTIONS,
        "refusals": list(unsupported_functions(version)),
    }


def _render_bytes(template: str, context: Mapping[str, Any]) -> bytes:
    """Return a rendered template in UTF-8."""
    return render(template, context).encode()
