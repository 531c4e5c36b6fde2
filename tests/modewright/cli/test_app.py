"""Values of a shell's pattern behind one option are those of as many options."""

from __future__ import annotations

import pytest

from modewright.cli.app import expand_arguments


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        (
            "diagnose rig --train a b --held-out c d -o x",
            "diagnose rig --train a --train b --held-out c --held-out d -o x",
        ),
        ("diagnose rig --train a --train b c", "diagnose rig --train a --train b --train c"),
        ("diagnose --train a rig", "diagnose --train a rig"),
        ("fit rig --parameters k --train a b", "fit rig --parameters k --train a --train b"),
        ("check a b", "check a b"),
        ("--help", "--help"),
        ("", ""),
    ],
)
def test_each_value_has_its_option(line: str, wanted: str) -> None:
    assert expand_arguments(line.split()) == wanted.split()
