"""ELF addresses: the locations of a module's structures in a linked program, from DWARF."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from language.text.diagnostic import MissingToolError
from language.text.regular_file import open_regular_file

if TYPE_CHECKING:
    from elftools.dwarf.die import DIE
    from elftools.elf.elffile import ELFFile

MAX_ARRAY_ELEMENTS = 64
"""Maximum number of elements of an array of instances that are listed."""
TRANSPARENT_TAGS = (
    "DW_TAG_const_type",
    "DW_TAG_volatile_type",
    "DW_TAG_typedef",
    "DW_TAG_restrict_type",
)
"""DWARF tags of types that only qualify or rename another type."""
MAX_TYPE_CHAIN = 100
"""Maximum length of a chain of TRANSPARENT_TAGS; a longer one is a cycle of a damaged file."""
NESTED_ARGUMENTS = re.compile(r"\('([^']*)',")
"""The begin of a message of pyelftools that is the text of the arguments of another exception."""
ELF_MAGIC = b"\x7fELF"
"""The first bytes of an ELF file."""
DW_OP_ADDR = 0x03
"""The DWARF operation DW_OP_addr, which an address follows."""


class ImageError(ValueError):
    """A file is not a linked program with debug information, or lacks the requested structure."""


@dataclass(frozen=True)
class StructLocation:
    """A structure in memory.

    `symbol` names it, like `app.selves[1]`. `members` gives offset and size [bytes] of each member
    by its path, like `state.w_em`. `is_const` is true for a structure that is never written.
    """

    symbol: str
    address: int
    members: Mapping[str, tuple[int, int]]
    is_const: bool = False


@dataclass(frozen=True)
class Image:
    """A linked program.

    `structures` are the locations of structures by C type, `symbols` the addresses of symbols,
    `strings` the texts at the requested symbols.
    """

    path: Path
    structures: Mapping[str, tuple[StructLocation, ...]]
    symbols: Mapping[str, int]
    strings: Mapping[str, str]
    is_little_endian: bool

    def select_structure(
        self, kind: str, candidates: Sequence[StructLocation], symbol: str | None
    ) -> StructLocation:
        """Return the only candidate, or the one named `symbol` if that is not None.

        `kind` is the C type, for messages. Raises ImageError, which lists the candidates, if there
        is no such candidate or more than one.
        """
        chosen = [place for place in candidates if symbol in (None, place.symbol)]
        if len(chosen) == 1:
            return chosen[0]
        if not candidates:
            raise ImageError(f"{self.path}: no {kind}: is its code linked, and compiled with -g?")
        known = ", ".join(place.symbol for place in candidates)
        if symbol and not chosen:
            raise ImageError(f"{self.path}: no {kind} is called `{symbol}`; there are: {known}")
        raise ImageError(f"{self.path}: one {kind} is needed, name it; there are: {known}")


def read_image(path: Path, types: tuple[str, ...], string_symbols: tuple[str, ...] = ()) -> Image:
    """Read a linked program: locations of structures of the given C types, texts at symbols.

    `types` are names of typedefs. Variables with a fixed address are searched, with their members
    and the first MAX_ARRAY_ELEMENTS elements of arrays; a type without a variable has an empty
    tuple. A symbol of `string_symbols` that the file lacks is left out of `strings`; a text ends
    after 256 characters. Raises ImageError if the file is unreadable, no ELF, damaged, or has no
    debug information; MissingToolError if pyelftools is missing.
    """
    try:
        from elftools.elf.elffile import ELFFile
    except ModuleNotFoundError:
        raise MissingToolError(
            "reading an ELF needs pyelftools: pip install 'modewright[elf]'"
        ) from None
    try:
        file = open_regular_file(path)
    except OSError as error:
        raise ImageError(f"{path}: {error.strerror}") from None
    with file:
        with _report_damage(path, "its header"):
            if file.read(len(ELF_MAGIC)) != ELF_MAGIC:
                raise ImageError(f"{path}: this is not a linked program (ELF)")
            elf = ELFFile(file)
            has_debug_information = elf.has_dwarf_info()
        if not has_debug_information:
            raise ImageError(f"{path}: it has no debug information; compile with -g")
        with _report_damage(path, "its debug information"):
            structures = _find_structures(elf, types)
        with _report_damage(path, "its symbol table"):
            symbols = _symbols(elf)
        with _report_damage(path, "its constants"):
            strings = {
                name: _string_at(elf, symbols[name]) for name in string_symbols if name in symbols
            }
        return Image(path, structures, symbols, strings, elf.little_endian)


@contextmanager
def _report_damage(path: Path, part: str) -> Iterator[None]:
    """Return a context that raises ImageError, which names `part`, for any other exception.

    pyelftools does not check what it reads: a damaged file leads to exceptions of many types, also
    of the interpreter, such as MemoryError and RecursionError.
    """
    try:
        yield
    except ImageError:
        raise
    except Exception as error:
        sentences = [text for text in error.args if isinstance(text, str) and " " in text]
        if sentences and (nested := NESTED_ARGUMENTS.match(sentences[0])):
            sentences = [nested[1]]
        reason = f": {sentences[0]}" if sentences else ""
        raise ImageError(f"{path}: the file is damaged, {part} cannot be read{reason}") from None


def _find_structures(elf: ELFFile, types: tuple[str, ...]) -> dict[str, tuple[StructLocation, ...]]:
    """Return the locations of structures of the given types, also those inside other variables."""
    by_type: dict[str, dict[str, StructLocation]] = {name: {} for name in types}
    for unit in elf.get_dwarf_info().iter_CUs():
        for die in unit.iter_DIEs():
            address = _address_of(die, elf)
            declared = _declaration_of(die)
            if address is None or "DW_AT_type" not in declared.attributes:
                continue
            variable = _name_of(declared)
            is_fixed = _is_const(_type_of(declared))
            for kind, symbol, start, made in _nested_structures(
                _type_of(declared), variable, address, types
            ):
                members = {path: (at, size) for path, at, size in _members(made, "", 0)}
                by_type[kind].setdefault(symbol, StructLocation(symbol, start, members, is_fixed))
    return {kind: tuple(by_symbol.values()) for kind, by_symbol in by_type.items()}


def _nested_structures(
    kind: DIE | None, symbol: str, address: int, types: tuple[str, ...]
) -> Iterator[tuple[str, str, int, DIE]]:
    """Yield the structures of the given types inside a variable: type name, symbol, address, DIE.

    Members of structures and up to MAX_ARRAY_ELEMENTS elements of arrays are searched.
    """
    for part in _qualifier_chain(kind):
        if part.tag == "DW_TAG_typedef" and _name_of(part) in types:
            structure = _strip_qualifiers(part)
            if structure is not None:
                yield _name_of(part), symbol, address, structure
            return
    kind = _strip_qualifiers(kind)
    if kind is None:
        return
    if kind.tag == "DW_TAG_structure_type":
        for member in _struct_fields(kind):
            place = address + _offset_of(member)
            yield from _nested_structures(
                _type_of(member), f"{symbol}.{_name_of(member)}", place, types
            )
    elif kind.tag == "DW_TAG_array_type":
        size = _byte_size(_type_of(kind))
        for k in range(min(_element_count(kind), MAX_ARRAY_ELEMENTS) if size else 0):
            yield from _nested_structures(
                _type_of(kind), f"{symbol}[{k}]", address + k * size, types
            )


def _members(structure: DIE, above: str, start: int) -> Iterator[tuple[str, int, int]]:
    """Yield path, offset and size [bytes] of each member at any depth that is no structure."""
    for member in _struct_fields(structure):
        path, place = f"{above}{_name_of(member)}", start + _offset_of(member)
        kind = _strip_qualifiers(_type_of(member))
        if kind is not None and kind.tag == "DW_TAG_structure_type":
            yield from _members(kind, f"{path}.", place)
        else:
            yield path, place, _byte_size(kind)


def _struct_fields(structure: DIE) -> Iterator[DIE]:
    """Return an iterator over the members of a structure."""
    return (child for child in structure.iter_children() if child.tag == "DW_TAG_member")


def _qualifier_chain(kind: DIE | None) -> Iterator[DIE]:
    """Yield a type and those that it refers to, as long as they have TRANSPARENT_TAGS.

    Raises ValueError if the type refers to itself, as in a damaged file.
    """
    for _ in range(MAX_TYPE_CHAIN):
        if kind is None or kind.tag not in TRANSPARENT_TAGS:
            return
        yield kind
        kind = _type_of(kind)
    raise ValueError("a type refers to itself")


def _strip_qualifiers(kind: DIE | None) -> DIE | None:
    """Return a type without qualifiers and typedefs; None for `void`."""
    chain = [*_qualifier_chain(kind)]
    return _type_of(chain[-1]) if chain else kind


def _is_const(kind: DIE | None) -> bool:
    """Tell whether a type is `const` and not `volatile`."""
    tags = [part.tag for part in _qualifier_chain(kind)]
    return "DW_TAG_const_type" in tags and "DW_TAG_volatile_type" not in tags


def _byte_size(kind: DIE | None) -> int:
    """Return the size of a type [bytes]; 0 if it is not known."""
    kind = _strip_qualifiers(kind)
    if kind is None:
        return 0
    if kind.tag == "DW_TAG_array_type":
        return _element_count(kind) * _byte_size(_type_of(kind))
    size = kind.attributes.get("DW_AT_byte_size")
    return int(size.value) if size else 0


def _element_count(array: DIE) -> int:
    """Return the number of elements of an array over all dimensions."""
    total = 1
    for child in array.iter_children():
        if child.tag == "DW_TAG_subrange_type":
            last, count = (child.attributes.get(f"DW_AT_{a}") for a in ("upper_bound", "count"))
            total *= int(count.value) if count else int(last.value) + 1 if last else 0
    return total


def _type_of(die: DIE) -> DIE | None:
    """Return the type of a variable, member or type; None if it has none."""
    has_one = "DW_AT_type" in die.attributes
    return die.get_DIE_from_attribute("DW_AT_type") if has_one else None


def _declaration_of(die: DIE) -> DIE:
    """Return the declaration that a definition without a type refers to, else `die` itself."""
    for name in ("DW_AT_specification", "DW_AT_abstract_origin"):
        if name in die.attributes and "DW_AT_type" not in die.attributes:
            return die.get_DIE_from_attribute(name)
    return die


def _name_of(die: DIE) -> str:
    """Return the name of a DIE in ASCII, other bytes as `\\xe4`; an empty text if it has none."""
    name = die.attributes.get("DW_AT_name")
    return name.value.decode("ascii", "backslashreplace") if name else ""


def _offset_of(member: DIE) -> int:
    """Return the offset of a member [bytes]."""
    at = member.attributes.get("DW_AT_data_member_location")
    return int(at.value) if at else 0


def _address_of(die: DIE, elf: ELFFile) -> int | None:
    """Return the address of a variable.

    Returns None if it has no fixed address, or if `die` is no variable.
    """
    at = die.attributes.get("DW_AT_location") if die.tag == "DW_TAG_variable" else None
    if (
        at is None
        or at.form not in ("DW_FORM_exprloc", "DW_FORM_block1")
        or at.value[0] != DW_OP_ADDR
    ):
        return None
    return int.from_bytes(bytes(at.value[1:]), "little" if elf.little_endian else "big")


def _symbols(elf: ELFFile) -> dict[str, int]:
    """Return the addresses of all symbols by name."""
    from elftools.elf.sections import SymbolTableSection

    tables = [one for one in elf.iter_sections() if isinstance(one, SymbolTableSection)]
    return {one.name: int(one["st_value"]) for table in tables for one in table.iter_symbols()}


def _string_at(elf: ELFFile, address: int) -> str:
    """Return the zero-terminated ASCII text at an address, at most 256 characters.

    Returns an empty text if the address is in no loaded section.
    """
    for section in elf.iter_sections():
        start = section["sh_addr"]
        if section["sh_type"] == "SHT_PROGBITS" and start <= address < start + section["sh_size"]:
            data = section.data()[address - start :]
            return bytes(data).partition(b"\0")[0][:256].decode("ascii", "replace")
    return ""
