"""Rendering: text from a template, and the version that stands in it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import metadata, resources
from typing import Any

import jinja2


def render(template: str, context: Mapping[str, Any]) -> str:
    """Return a template filled in; a hole without a value is an error."""
    return _environment().get_template(template).render(context)


@cache
def _environment() -> jinja2.Environment:
    folder = resources.files("codegen").joinpath("templates")
    return jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: folder.joinpath(name).read_text("utf-8")),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )


def version() -> str:
    """Return the version of the product."""
    return metadata.version("modewright")
