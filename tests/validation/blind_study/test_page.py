"""Page: what docs/proof.md claims was measured with the method as it is."""

from __future__ import annotations

from tests.validation.blind_study.page import PAGE, is_current
from tests.validation.figures.store import ROOT


def test_a_page_that_is_published_belongs_to_the_method_as_it_is() -> None:
    assert is_current(PAGE.read_text()) if PAGE.exists() else not _claims()


def _claims() -> list[str]:
    """Return the pages that speak of a study that is not there."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    return [page.name for page in pages if "](proof.md)" in page.read_text()]
