# SPDX-License-Identifier: MIT
"""Whether a C3D file is whole: its parameters follow each other, and its data are as long as they say.

ezc3d ends the process where data end early or parameters overlap, so that this is checked before ezc3d opens a file.
The layout is that of the C3D user guide (c3d.org): a header, parameters, data, each from a block of 512 bytes on.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

__all__ = ["check_whole"]

BLOCK = 512
KEY = 0x50  # second byte of the header and of the parameters
DEC, MIPS = 85, 86
ROTATION_BYTES = 17 * 4  # a 4 x 4 matrix and a residual, float32
BYTES_OF = {-1: 1, 1: 1, 2: 2, 4: 4}  # of a parameter's type: text, byte, integer, float


@dataclass
class Parameter:
    """A parameter, and its value if it is one integer."""

    group: str
    name: str
    integer: int | None


def check_whole(path: Path) -> None:
    """ValueError if the file is no C3D file, is damaged, or ends before its data do."""
    content = path.read_bytes()
    if len(content) < 2 or content[1] != KEY:
        raise ValueError(f"{path}: expected a C3D file, but it does not begin as one")
    try:
        needed = _needed(content)
    except (struct.error, IndexError):
        needed = len(content) + 1
    except (KeyError, ValueError):
        raise ValueError(
            f"{path}: the parameters of the C3D file are damaged; copy or export it again"
        ) from None
    if needed > len(content):
        raise ValueError(f"{path}: the C3D file is truncated; copy or export it again")


def _needed(content: bytes) -> int:
    """Bytes up to the end of the data."""
    start = (content[0] - 1) * BLOCK
    processor = content[start + 3]
    order = ">" if processor == MIPS else "<"
    points, analogues, first, last = struct.unpack_from(f"{order}4H", content, 2)
    (data_block,) = struct.unpack_from(f"{order}H", content, 16)
    parameters = list(_parameters(content, start + 4, order))
    values = {(p.group, p.name): p.integer for p in parameters if p.integer is not None}
    frames = last - first + 1
    if frames < 0 or data_block < 2 or values.get(("POINT", "USED"), points) != points:
        raise ValueError
    channels = values.get(("ANALOG", "USED"), analogues)
    # A frame has as many samples of each channel as of the others.
    if (channels > 0) != (analogues > 0) or (channels and analogues % channels):
        raise ValueError
    # The sign of the scale says whether numbers are float or integer; DEC has it in the first word of a float.
    word = 4 if content[13 if processor == DEC else 15] & 0x80 else 2
    needed = (data_block - 1) * BLOCK + frames * word * (4 * points + analogues)
    if any(p.group == "ROTATION" for p in parameters):
        begin, used = values["ROTATION", "DATA_START"], values["ROTATION", "USED"]
        ratio = values.get(("ROTATION", "RATIO"), 1)
        needed = max(needed, (begin - 1) * BLOCK + frames * ratio * used * ROTATION_BYTES)
    return needed


def _parameters(content: bytes, at: int, order: str) -> Iterator[Parameter]:
    """All parameters; ValueError unless each ends where the next one begins, and belongs to a group."""
    names: dict[int, str] = {}
    found: list[tuple[int, str, int | None]] = []
    while length := abs(struct.unpack_from("b", content, at)[0]):
        (number,) = struct.unpack_from("b", content, at + 1)
        name = content[at + 2 : at + 2 + length].decode("latin-1").upper()
        if not name.isascii() or not name.isprintable():
            raise ValueError
        link = at + 2 + length
        (offset,) = struct.unpack_from(f"{order}H", content, link)
        end = link + 2
        if number < 0:
            names[-number] = name
        else:
            kind, dimensions = struct.unpack_from("bB", content, end)
            shape = content[end + 2 : end + 2 + dimensions]
            count = math.prod(shape)
            end += 2 + dimensions
            integer = struct.unpack_from(f"{order}H", content, end)[0] if kind == 2 and count == 1 else None
            found.append((number, name, integer))
            end += BYTES_OF[kind] * count
        end += 1 + content[end]  # the description
        if offset and link + offset != end:
            raise ValueError
        if not offset:
            break
        at = end
    if any(number not in names for number, _, _ in found):
        raise ValueError
    yield from (Parameter(names[number], name, integer) for number, name, integer in found)
