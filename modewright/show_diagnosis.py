"""Show diagnosis: verdicts and fits for people at a console."""

from __future__ import annotations

from rich.console import Console

from diagnosis.dossier import Dossier
from diagnosis.wording import summary


def print_dossier(screen: Console, dossier: Dossier) -> None:
    """Print a diagnosis in at most four lines."""
    for line in summary(dossier):
        screen.print(line.replace("`", ""), highlight=False, markup=False, soft_wrap=True)
