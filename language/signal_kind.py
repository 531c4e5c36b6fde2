"""Signal kind: what each signal of a system is."""

from __future__ import annotations

from language.connection import output_kinds
from language.declared import declared_kind
from language.experiment import System
from language.kind import ExprType


def signal_kinds(system: System) -> dict[str, ExprType]:
    """Return what each signal of a system is: inputs, outputs of instances, sensors, outputs."""
    found: dict[str, ExprType] = {
        name: declared_kind(thing) for name, thing in system.inputs.items()
    }
    for instance in system.instances.values():
        found.update(output_kinds(instance))
    found.update({name: sensor.dimension for name, sensor in system.sensors.items()})
    for name, output in system.outputs.items():
        if isinstance(output, str) and output in found:
            found[name] = found[output]
        elif name in system.dimensions:
            found[name] = system.dimensions[name]
    return found
