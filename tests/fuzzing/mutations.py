"""Mutations: changes of the bytes of a file, reproducible by a seed."""

from __future__ import annotations

import random
from collections.abc import Callable

TOKENS = (
    *(b"nan", b"inf", b"-inf", b"1e999", b"-1e-999", b"1e300", b"9" * 400, b"0x1F", b"1,5", b"--"),
    *(b"\0", b"\x1b[31m", b"\xff\xfe", b"\xef\xbb\xbf", b"\xe2\x80\xae", b"\r", b"\n\n", b"\t"),
    *(b'"', b"'", b"[" * 3000, b"{" * 300, b"}", b"]", b": ", b"- ", b"&a ", b"*a", b"!!python/x "),
    *(b";", b",,,,", b"|", b"#", b"//", b"=cmd|", b"null", b"true", b"-1", b"0", b"a" * 5000),
)
"""Texts that programs often treat in a special way."""
NUMBERS = (0, 1, 0x7F, 0x80, 0xFF)
"""Values of single bytes at the bounds of number types."""


def mutate(data: bytes, seed: str) -> bytes:
    """Return changed bytes; one to four changes, which follow from the seed."""
    chance = random.Random(seed)
    changed = bytearray(data)
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        chance.choice(CHANGES)(changed, chance)
    return bytes(changed)


def _place(data: bytearray, chance: random.Random) -> int:
    return chance.randrange(len(data) + 1)


def _part(data: bytearray, chance: random.Random) -> slice:
    start = _place(data, chance)
    return slice(start, min(len(data), start + chance.choice((1, 2, 8, 64, 1000))))


def _change_byte(data: bytearray, chance: random.Random) -> None:
    if data:
        data[chance.randrange(len(data))] = chance.choice((*NUMBERS, chance.randrange(256)))


def _flip_bit(data: bytearray, chance: random.Random) -> None:
    if data:
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)


def _insert_token(data: bytearray, chance: random.Random) -> None:
    place = _place(data, chance)
    data[place:place] = chance.choice(TOKENS)


def _replace_by_token(data: bytearray, chance: random.Random) -> None:
    data[_part(data, chance)] = chance.choice(TOKENS)


def _remove(data: bytearray, chance: random.Random) -> None:
    del data[_part(data, chance)]


def _repeat(data: bytearray, chance: random.Random) -> None:
    place, part = _place(data, chance), bytes(data[_part(data, chance)])
    data[place:place] = part * chance.choice((1, 2, 50))


def _cut(data: bytearray, chance: random.Random) -> None:
    del data[_place(data, chance) :]


def _swap_lines(data: bytearray, chance: random.Random) -> None:
    lines = data.split(b"\n")
    a, b = chance.randrange(len(lines)), chance.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    data[:] = b"\n".join(lines)


CHANGES: tuple[Callable[[bytearray, random.Random], None], ...] = (
    _change_byte, _flip_bit, _insert_token, _replace_by_token, _remove, _repeat, _cut, _swap_lines,
)  # fmt: skip
