"""Digests of all labels of a study, stored before a case is diagnosed.

A change of the labels after the first diagnosis would change a digest.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from tests.validation.evidence.evidence_store import ROOT, write_json
from tests.validation.study.cases import generate_cases
from tests.validation.study.generator_table import Generator

DIGESTS = ROOT / "docs" / "evidence" / "validation_labels.json"
Digests = Mapping[str, str]
"""SHA-256 of the labels by `generator/group`."""


def label_digests(every: Sequence[Generator]) -> dict[str, str]:
    """Return the digests of all groups of generators; the cases are written if they are missing."""
    return {
        group.key: generate_cases(generator, group).digest
        for generator in every
        for group in generator.groups
    }


def store_digests(found: Digests) -> None:
    """Write digests to the file of the study."""
    write_json(DIGESTS, found)


def stored_digests() -> dict[str, str]:
    """Return the stored digests; empty if there are none."""
    return json.loads(DIGESTS.read_text()) if DIGESTS.exists() else {}


def changed_groups(found: Digests) -> list[str]:
    """Return the groups whose labels have another digest than the stored one."""
    stored = stored_digests()
    return [key for key, digest in found.items() if stored.get(key, digest) != digest]
