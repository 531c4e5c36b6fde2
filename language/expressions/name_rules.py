"""Name rules: the form of names, and names that are reserved or collide with others (rule C9)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources

from language.expressions.migration_hints import increment_hint
from language.text.diagnostic import Problems, Span

C_MACRO_PATTERN = re.compile(
    r"INFINITY|NAN|HUGE_VAL[FL]?|MATH_ERR\w*|math_errhandling|FP_\w+|(DBL|FLT|LDBL)_\w+|DECIMAL_DIG"
    r"|U?INT\w*_(MAX|MIN|C)|(PTRDIFF|SIZE|WCHAR|WINT|SIG_ATOMIC)_(MAX|MIN)|NULL|errno|M_(E|PI\w*)"
)
"""Macros of the headers that generated code includes."""

C_HEADERS = """
assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdalign
stdarg stdatomic stdbool stddef stdint stdio stdlib stdnoreturn string tgmath threads time uchar
wchar wctype"""
"""Headers of the C library (ISO/IEC 9899:2011, 7.1.2), without their suffix."""
FILE_WORDS = frozenset({"main", "ha_math", "ha_page", *C_HEADERS.split()})
"""File names that the files of an automaton would collide with."""

DEVICE_NAME_PATTERN = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)", re.IGNORECASE)
"""File names that Windows reserves for devices, with any suffix."""


@cache
def reserved_words() -> Mapping[str, frozenset[str]]:
    """Return the reserved words by section: GRAMMAR, YAML, C, C++, C library, A2L, GENERATED.

    They are read from the file reserved.txt once.
    """
    text = resources.files("language.expressions").joinpath("reserved.txt").read_text("utf-8")
    sections: dict[str, frozenset[str]] = {}
    for section in text.split("\n[")[1:]:
        head, _, words = section.partition("\n")
        sections[head.partition("]")[0]] = frozenset(words.split())
    return sections


NAME_PATTERN = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,30}")
DOCUMENT_NAME_PATTERN = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")
"""Form of the names of documents that are no identifiers in C."""

COMMA_HINT = "in `{...}` YAML ends a value at a comma: quote a value that has one"


def check_name(name: str, span: Span, problems: Problems) -> None:
    """Report a name of a wrong form or a reserved name, with one problem of kind "name" at most.

    The form is that of NAME_PATTERN: a letter, then at most 30 letters, digits or `_`. Reserved are
    the words of `reserved_words`, those of YAML in any case, and the macros of C_MACRO_PATTERN
    (docs/language.md, "Names, numbers, units"). Words of the C library are not reported: they are
    reserved for variables only (`check_variable_name`).
    """
    words = reserved_words()
    another = f"another name, like `{name}_1`"
    if not NAME_PATTERN.fullmatch(name):
        hint = COMMA_HINT if ")" in name else increment_hint(name)
        hint = hint or "a letter, then at most 30 letters, digits or `_`"
        problems.error("name", span, f"`{name}` is not a name", hint)
    elif name in words["GRAMMAR"]:
        problems.error("name", span, f"`{name}` is a word of the language", another)
    elif name.lower() in words["YAML"]:
        _report_word_of_yaml(name, span, problems)
    elif name in words["GENERATED"]:
        label = f"`{name}` has a meaning of its own in generated code"
        problems.error("name", span, label, another)
    else:
        for language in ("C", "C++", "A2L"):
            if name in words[language] or (language == "C" and C_MACRO_PATTERN.fullmatch(name)):
                label = f"`{name}` is a word of {language}, and generated files keep the names"
                problems.error("name", span, label, another)
                return


def check_document_name(name: str, span: Span, problems: Problems) -> None:
    """Report the name of a document that is in no C, with one problem of kind "name" at most.

    These are systems, scenarios, maps, variants, calibrations, studies and tests. The form is that
    of DOCUMENT_NAME_PATTERN; the words of YAML are reported as in `check_name`. The words of the
    language, of C and of A2L are allowed. An automaton and an effect follow stricter rules.
    """
    if not DOCUMENT_NAME_PATTERN.fullmatch(name):
        hint = "a letter, then at most 62 letters, digits or `_`"
        problems.error("name", span, f"`{name}` is not a name", hint)
    elif name.lower() in reserved_words()["YAML"]:
        _report_word_of_yaml(name, span, problems)


def _report_word_of_yaml(name: str, span: Span, problems: Problems) -> None:
    """Report a name that other tools for YAML do not read as a text."""
    label = f"`{name}` means something else to other YAML tools: they read true, false or null"
    problems.error("name", span, label, f"another name, like `{name}_1`")


def check_variable_name(name: str, span: Span, problems: Problems) -> None:
    """Report the name of a variable that is a word of the C library, as "name" at `span`.

    In generated C the names of variables are identifiers of their own; those of modes, transitions,
    events and regions are parts of longer ones, and may be words of the library. The form and the
    other words are those of `check_name`, which is called where the name is read.
    """
    if name in reserved_words()["C library"]:
        label = f"`{name}` is a word of the C library, and generated files keep the names"
        problems.error("name", span, label, f"another name, like `{name}_1`")


def check_region_name(name: str, span: Span, problems: Problems) -> None:
    """Report a wrong name of a region or an instance, by the rules of `check_name`.

    `main` is allowed, because in C the name is only a part of a longer name, or a member.
    """
    if name != "main":
        check_name(name, span, problems)


def check_file_name(name: str, span: Span, problems: Problems) -> None:
    """Report a wrong name of an automaton, also one that cannot be the name of its files.

    The rules are those of `check_name`; in addition, FILE_WORDS (among them the headers of the C
    library) and device names of Windows are reported in any case.
    """
    check_name(name, span, problems)
    if name.lower() in FILE_WORDS or DEVICE_NAME_PATTERN.fullmatch(name):
        label = f"an automaton is not called `{name}`: that is another file"
        problems.error("name", span, label, f"another name, like `{name}_1`")


def report_case_collisions(names: Iterable[tuple[str, Span]], problems: Problems) -> None:
    """Report each name that differs from an earlier one in case only, as "duplicate" at its span.

    A name is compared with the first one of its lower-case form; equal names are not reported. Many
    tools for A2L and CSV do not distinguish case.
    """
    first: dict[str, tuple[str, Span]] = {}
    for name, span in names:
        other, place = first.setdefault(name.lower(), (name, span))
        if other != name:
            label = f"`{name}` and `{other}` differ in case only"
            hint = f"`{other}` is at {place}; tools for A2L and tables take them for one"
            problems.error("duplicate", span, label, hint)
