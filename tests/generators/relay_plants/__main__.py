"""Command line: write cases with known missing effects, and their labels."""

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from .cases import known_effects, write_case


def requests(text: str) -> list[tuple[str, ...]]:
    """Effects of each case from a text such as `all:4,none:20,a:2,a+b:1`."""
    known = known_effects()
    found: list[tuple[str, ...]] = []
    for part in text.split(","):
        name, _, count = part.strip().partition(":")
        groups: list[tuple[str, ...]] = [(id_,) for id_ in known]
        groups = groups if name == "all" else [tuple(name.split("+"))]
        groups = [()] if name == "none" else groups
        for group in groups:
            if unknown := set(group) - set(known):
                raise SystemExit(f"unknown effects {sorted(unknown)}; known: {', '.join(known)}")
            found += [group] * int(count or 1)
    return found


def main() -> None:
    """Write the cases that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the cases")
    parser.add_argument("--labels", type=Path, required=True, help="JSON file of the labels")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--effects", default="all:4,none:20", help="such as a:2,b:1,a+b:1")
    parser.add_argument("--strength", type=float, default=1.0, help="0 writes clean twins")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    groups = requests(options.effects)
    order = np.random.default_rng(options.seed).permutation(len(groups))
    names = [f"case_{number:03d}" for number in order]
    with ProcessPoolExecutor(options.jobs) as pool:
        futures = [
            pool.submit(write_case, options.out / name, group, (options.seed, k), options.strength)
            for k, (name, group) in enumerate(zip(names, groups, strict=True))
        ]
        cases = {name: f.result() for name, f in zip(names, futures, strict=True)}
    labels = {"seed": options.seed, "cases": dict(sorted(cases.items()))}
    options.labels.parent.mkdir(parents=True, exist_ok=True)
    options.labels.write_text(json.dumps(labels, indent=1) + "\n")


if __name__ == "__main__":
    main()
