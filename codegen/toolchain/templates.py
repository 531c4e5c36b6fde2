"""Templates: renders text with Jinja, and gives the version of the product (rule C25)."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib import metadata, resources
from typing import Any

import jinja2
from jinja2.bccache import Bucket

from codegen.toolchain.build_cache import cache_subfolder

TEMPLATE_CACHE = "templates"
"""The folder inside the cache for compiled templates."""


def render(template: str, context: Mapping[str, Any]) -> str:
    """Return a rendered template; a variable without a value is an error (rule C25)."""
    return _environment().get_template(template).render(context)


@cache
def _environment() -> jinja2.Environment:
    """Return the Jinja environment of the templates of this package."""
    folder = resources.files("codegen").joinpath("templates")
    return jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: folder.joinpath(name).read_text("utf-8")),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
        bytecode_cache=_template_cache(),
    )


class _TemplateCache(jinja2.FileSystemBytecodeCache):
    """A cache of compiled templates that ignores damaged and unwritable files.

    The compilation of all templates takes 0.1 s.
    """

    def load_bytecode(self, bucket: Bucket) -> None:
        with suppress(OSError, EOFError, ValueError, pickle.UnpicklingError):
            super().load_bytecode(bucket)

    def dump_bytecode(self, bucket: Bucket) -> None:
        with suppress(OSError):
            super().dump_bytecode(bucket)


def _template_cache() -> jinja2.BytecodeCache | None:
    """Return the cache of compiled templates; None if the cache cannot be used."""
    folder = cache_subfolder(TEMPLATE_CACHE)
    return _TemplateCache(str(folder)) if folder else None


def product_version() -> str:
    """Return the version of the product."""
    return metadata.version("modewright")
