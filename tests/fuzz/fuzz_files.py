# SPDX-License-Identifier: MIT
"""Damaged and crafted files: small changes of valid ones, with their checksums made right again."""

import json
import random
import re
import struct
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fuzz_targets import MEANT, MEMORY_BYTES, MEMORY_FACTOR, Case, Unclear, any_of

__all__ = ["file_case", "folder_case", "mutated", "repaired_png"]

NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
NASTY_NUMBERS = (
    b"0", b"-1", b"1", b"nan", b"NaN", b"inf", b"-Infinity", b"1e308", b"1e400", b"-1e400", b"1e-320", b"2147483647",
    b"2147483648", b"-2147483649", b"4294967296", b"18446744073709551616", b"9" * 400, b"9" * 5000, b"0.5", b"", b"x",
    b"1e9", b"99999", b"[]", b"{}", b"null", b"true", b'"x"', b"7.9",
)  # fmt: skip
LENGTHS = (0, 1, *(2**n - 1 for n in (7, 8, 16, 31, 32, 63, 64)), *(2**n for n in (7, 8, 16, 24, 31)), 10**9)
FORMS = ("<B", "<H", ">H", "<I", ">I", "<I", ">I", "<Q", ">Q", "<f", "<d")
JSON_VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1, 0.5, 1e308, 2**31, 2**63, 10**400, "", "x", [], {}, [[]], [1, 2], {"a": 1}, "a" * 3000,
    -0.0, 7.9,
)  # fmt: skip
DEEP = 5000


def mutated(rng: random.Random, data: bytes, others: tuple[bytes, ...] = ()) -> bytes:
    """One to four changes of a file."""
    text = not any(b in data[:2000] for b in (b"\0", b"\xff", b"\x89"))
    for _ in range(rng.choices((1, 2, 3, 4), (8, 4, 2, 1))[0]):
        ways = TEXT_WAYS if text and rng.random() < 0.7 else BINARY_WAYS
        data = rng.choice(ways)(rng, data, others)
    return data


def _flip(rng: random.Random, data: bytes, others: tuple[bytes, ...]) -> bytes:
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8, 64)) if out else 0):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def _bytes(rng: random.Random, data: bytes, others: tuple[bytes, ...]) -> bytes:
    at, n = _span(rng, data)
    return data[:at] + rng.choice((bytes(n), b"\xff" * n, rng.randbytes(n), b"\x80" * n)) + data[at + n :]


def _cut(rng: random.Random, data: bytes, others: tuple[bytes, ...]) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _splice(rng: random.Random, data: bytes, others: tuple[bytes, ...]) -> bytes:
    source = rng.choice((data, *others))
    at, n = _span(rng, source)
    to, gone = _span(rng, data)
    return data[:to] + source[at : at + n] + data[to + rng.choice((0, gone)) :]


def _length(rng: random.Random, data: bytes, others: tuple[bytes, ...]) -> bytes:
    """A number at the ends of its type in the place of any, more often near the beginning."""
    form = rng.choice(FORMS)
    size = struct.calcsize(form)
    end = min(len(data), rng.choice((64, 512, len(data))))
    if end < size:
        return data
    at = rng.randrange(end - size + 1)
    at -= at % size if rng.random() < 0.5 else 0
    value: float = rng.choice(LENGTHS)
    if form[1] in "fd":
        value = rng.choice((float("nan"), float("inf"), 1e30, -1.0, 1e-40, 0.0))
    else:
        value = int(value) % (1 << 8 * size)
    return data[:at] + struct.pack(form, value) + data[at + size :]


def _number(rng: random.Random, data: bytes, others: tuple[bytes, ...]) -> bytes:
    found = list(NUMBER.finditer(data[:50_000]))
    if not found:
        return data
    one = rng.choice(found)
    return data[: one.start()] + rng.choice(NASTY_NUMBERS) + data[one.end() :]


def _line(rng: random.Random, data: bytes, others: tuple[bytes, ...]) -> bytes:
    lines = data.split(b"\n")
    at, to = rng.randrange(len(lines)), rng.randrange(len(lines))
    how = rng.randrange(4)
    if how == 0:
        del lines[at]
    elif how == 1:
        lines.insert(to, lines[at])
    elif how == 2:
        lines[at], lines[to] = lines[to], lines[at]
    else:
        lines[at] = lines[at][: rng.randrange(len(lines[at]) + 1)]
    return b"\n".join(lines)


def _json(rng: random.Random, data: bytes, others: tuple[bytes, ...]) -> bytes:
    """Another value in the place of any of a JSON file; of another file, a number."""
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):
        return _number(rng, data, others)
    if rng.random() < 0.02:
        return rng.choice((b"[" * DEEP, b'{"a":' * DEEP, b"[" * DEEP + b"]" * DEEP))
    try:
        return json.dumps(changed_value(rng, value)).encode()
    except (ValueError, RecursionError):
        return data


def changed_value(rng: random.Random, value: Any) -> Any:
    """A tree of JSON with one value changed."""
    if isinstance(value, dict) and value and rng.random() < 0.85:
        key = rng.choice(list(value))
        out = dict(value)
        how = rng.random()
        if how < 0.1:
            del out[key]
        elif how < 0.15:
            out[rng.choice(("", "x", "-1", "9" * 400, key + " "))] = out.pop(key)
        else:
            out[key] = changed_value(rng, value[key])
        return out
    if isinstance(value, list) and value and rng.random() < 0.85:
        items = list(value)
        at = rng.randrange(len(items))
        how = rng.random()
        if how < 0.1:
            del items[at]
        elif how < 0.2:
            items.append(items[at])
        else:
            items[at] = changed_value(rng, items[at])
        return items
    return rng.choice(JSON_VALUES)


def _span(rng: random.Random, data: bytes) -> tuple[int, int]:
    at = rng.randrange(len(data) + 1)
    return at, min(len(data) - at, rng.choice((1, 2, 4, 8, 32, 200, 2000)))


BINARY_WAYS: tuple[Callable[..., bytes], ...] = (
    _flip,
    _flip,
    _bytes,
    _cut,
    _splice,
    _length,
    _length,
    _length,
    _number,
)
TEXT_WAYS: tuple[Callable[..., bytes], ...] = (_number, _number, _number, _line, _json, _json, _cut)


def repaired_png(data: bytes) -> bytes:
    """A PNG file whose chunks have the right checksums, as far as there are chunks."""
    out, at = bytearray(data), 8
    while at + 12 <= len(out):
        (length,) = struct.unpack_from(">I", out, at)
        if at + 12 + length > len(out):
            break
        struct.pack_into(">I", out, at + 8 + length, zlib.crc32(bytes(out[at + 4 : at + 8 + length])))
        at += 12 + length
    return bytes(out)


def file_case(
    folder: Path,
    seeds: dict[str, bytes],
    read: Callable[[Path], Any],
    *,
    repair: Callable[[random.Random, bytes], bytes] | None = None,
    change: Callable[[random.Random, str, bytes], bytes] | None = None,
    suffixes: tuple[str, ...] = (),
) -> Case:
    """Read one of some files, changed. `suffixes`: other endings that it may have."""
    for name, data in seeds.items():
        (folder / name).write_bytes(data)
        try:
            read(folder / name)  # also takes what is loaded only once
        except MEANT as error:
            raise AssertionError(f"the seed {name} is not read: {error}") from error

    def case(rng: random.Random) -> Any:
        name = rng.choice(list(seeds))
        data = seeds[name]
        if change is not None and rng.random() < 0.5:
            data = change(rng, name, data)
        else:
            data = mutated(rng, data, tuple(seeds.values()))
            if repair is not None and rng.random() < 0.8:
                data = repair(rng, data)
        path = (
            folder
            / f"case{Path(name).suffix if not suffixes or rng.random() < 0.8 else rng.choice(suffixes)}"
        )
        path.write_bytes(data)
        return bounded(lambda: read(path), path, len(data))

    return case


def folder_case(folder: Path, files: dict[str, bytes], read: Callable[[Path], Any]) -> Case:
    """Read a folder of which one or two files are changed or absent."""
    root = folder / "set"
    _fill(root, files)
    read(root)

    def case(rng: random.Random) -> Any:
        names = rng.sample(list(files), rng.choices((1, 2), (4, 1))[0]) if len(files) > 1 else list(files)
        try:
            for name in names:
                if rng.random() < 0.05:
                    (root / name).unlink()
                    continue
                data = mutated(rng, files[name], tuple(files.values()))
                if name.endswith(".png") and rng.random() < 0.7:
                    data = repaired_png(data)
                (root / name).write_bytes(data)
            size = sum((root / name).stat().st_size for name in files if (root / name).is_file())
            return bounded(lambda: read(root), root, size)
        finally:
            _fill(root, {name: files[name] for name in names})

    return case


def file_cases(
    folder: Path, *readers: tuple[dict[str, bytes], Callable[[Path], Any]], **options: Any
) -> Case:
    """A file case of any of several readers, each with a folder of its own."""
    cases = []
    for n, (seeds, read) in enumerate(readers):
        place = folder / f"reader{n}"
        place.mkdir()
        cases.append(file_case(place, seeds, read, **options))
    return any_of(cases)


def _fill(root: Path, files: dict[str, bytes]) -> None:
    for name, data in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_bytes(data)


def bounded(read: Callable[[], Any], path: Path, size: int) -> Any:
    """Read within the memory that a file of this size may take; an error must name the file, or one in its folder."""
    before = _memory("VmRSS", reset=True)
    try:
        return read()
    except MEANT as error:
        if path.name not in str(error) and str(path.parent) not in str(error):
            raise Unclear(f"{type(error).__name__} without the file's name: {error}") from error
        raise
    finally:
        taken = _memory("VmHWM") - before
        if taken > MEMORY_FACTOR * size + MEMORY_BYTES:
            raise Unclear(f"{taken / 1e6:.0f} MB taken by a file of {size} bytes")


def _memory(what: str, reset: bool = False) -> int:
    try:
        if reset:
            Path("/proc/self/clear_refs").write_text("5")
        with open("/proc/self/status") as file:
            return next(1024 * int(line.split()[1]) for line in file if line.startswith(what))
    except (OSError, StopIteration):  # elsewhere than on Linux
        return 0


def beside() -> None:
    """What the other tests write and make can be imported."""
    tests = Path(__file__).resolve().parents[1]
    sys.path += [folder for folder in (str(tests / "python"), str(tests)) if folder not in sys.path]
