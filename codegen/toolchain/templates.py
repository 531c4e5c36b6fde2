"""Templates: renders text with Jinja, and gives the version of the product (rule C25)."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import jinja2
from jinja2.bccache import Bucket

from codegen.toolchain.build_cache import cache_subfolder, read_sealed, write_sealed
from language.text.sanitise import escape_output

CODEGEN = __name__.partition(".toolchain")[0]
"""The package of the C templates: `codegen`, which the wheel has below `modewright`."""
TEMPLATE_CACHE = "templates"
"""The folder inside the cache for compiled templates."""


def render(template: str, context: Mapping[str, Any]) -> str:
    """Return a rendered template of codegen/templates, without HTML escapes.

    `template` is its path in that folder. A variable without a value raises jinja2.UndefinedError
    (rule C25).
    """
    return template_environment((CODEGEN,), is_html=False).get_template(template).render(context)


def render_html(packages: tuple[str, ...], template: str, context: Mapping[str, Any]) -> str:
    """Return a rendered HTML page, with the values of the context escaped.

    The template and the templates that it includes are in the folders `templates` of the packages,
    searched in that order. A variable without a value raises jinja2.UndefinedError.
    """
    return template_environment(packages, is_html=True).get_template(template).render(context)


def _escape_value(value: Any) -> Any:
    """Return a value of a page without invisible characters; HTML that a template makes is kept."""
    return escape_output(value) if type(value) is str else value


@cache
def template_environment(packages: tuple[str, ...], is_html: bool) -> jinja2.Environment:
    """Return the Jinja environment of the templates of packages; one for each pair of arguments.

    A variable without a value is an error. Values are escaped if `is_html`. Compiled templates are
    cached on disk if the cache can be used.
    """
    return jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(package) for package in packages]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=is_html,
        finalize=_escape_value if is_html else None,
        bytecode_cache=_template_cache(),
    )


@dataclass(frozen=True)
class _TemplateCache(jinja2.BytecodeCache):
    """Compiled templates in sealed files of a folder; damaged files are written anew.

    The compilation of all templates takes 0.1 s. Bytecode is executed when it is loaded, so it must
    be exactly what was stored.
    """

    folder: Path

    def load_bytecode(self, bucket: Bucket) -> None:
        data = read_sealed(self._path_of(bucket))
        if data is not None:
            bucket.bytecode_from_string(data)

    def dump_bytecode(self, bucket: Bucket) -> None:
        with suppress(OSError):
            write_sealed(self._path_of(bucket), bucket.bytecode_to_string())

    def _path_of(self, bucket: Bucket) -> Path:
        """Return the path of the file of a template."""
        return self.folder / f"{bucket.key}.template"


def _template_cache() -> jinja2.BytecodeCache | None:
    """Return the cache of compiled templates; None if the cache cannot be used."""
    folder = cache_subfolder(TEMPLATE_CACHE)
    return _TemplateCache(folder) if folder else None


def product_version() -> str:
    """Return the version of the installed package `modewright`."""
    return metadata.version("modewright")
