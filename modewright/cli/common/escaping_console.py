"""Escaping console: a console of rich that escapes texts, but not its own colours."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.errors import MarkupError
from rich.segment import Segment
from rich.text import Text

from language.text.sanitise import escape_output


class EscapingConsole(Console):
    """Console that escapes invisible characters of what it prints (`escape_output`)."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Yield the segments of a renderable with escaped texts; control codes of rich stay."""
        for segment in super().render(renderable, options):
            text = segment.text if segment.control else escape_output(segment.text)
            yield Segment(text, segment.style, segment.control)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return a text with its markup; a text with invalid markup has none."""
        try:
            return super().render_str(text, **options)
        except MarkupError:
            return super().render_str(text, **{**options, "markup": False})
