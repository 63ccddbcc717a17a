# SPDX-License-Identifier: MIT
"""Tables as aligned text."""

from __future__ import annotations

from collections.abc import Sequence


def text_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Aligned columns; the first left-aligned, numbers right-aligned."""
    widths = [max(len(r[i]) for r in [head, *rows]) for i in range(len(head))]
    lines = [
        "  ".join(
            c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(r, widths, strict=True))
        )
        for r in [head, *rows]
    ]
    return "\n".join([title, *(line.rstrip() for line in lines)])
