# SPDX-License-Identifier: MIT
"""Write what follows from the schema of options: the fields of Python's classes, signatures, tables of the documents.

    python bindings/generate_options.py            # after a change in cpp/*/**/option_schema.h and a build
    python bindings/generate_options.py --check    # exits with 1 where a file is out of date

Only the lines between the marks of a file are written. It stands here, beside the bindings, because it turns the core's
schema into Python as they do, needs the repository, and has no place in the installed package.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

from sdftrack._internal.option_schema import Option, schema_of
from sdftrack.contour.lwpr_data import AUTO

ROOT = Path(__file__).resolve().parents[1]
WIDTH = 110  # of a line, as ruff formats
BEGIN, END = "# options: written by bindings/generate_options.py", "# options: end"
TYPES = {"bool": "bool", "int": "int", "number": "float", "choice": "str", "numbers": "ArrayLike"}

Lines = list[str]
Render = Callable[[str], Lines]


def literal(value: object) -> str:
    """The value as ruff writes it."""
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def type_of(option: Option, types: dict[str, str]) -> str:
    return types.get(option.name, TYPES[option.kind]) + (" | None" if option.may_be_none else "")


def default_of(table: str, option: Option) -> object:
    """As Python has it: some of LWPR's options follow from the data, which the core does not know."""
    return "auto" if table == "lwpr" and option.name in AUTO else option.default


def fields(**types: str) -> Render:
    """Fields of a frozen dataclass."""

    def render(table: str) -> Lines:
        lines = []
        for option in schema_of(table).values():
            start = f"    {option.name}: {type_of(option, types)} = described("
            arguments = [literal(option.default), literal(option.meaning)]
            inside = ", ".join(arguments)
            if len(start) + len(inside) < WIDTH:
                lines.append(f"{start}{inside})")
            elif len(inside) + 8 <= WIDTH:
                lines += [start, f"        {inside}", "    )"]
            else:
                lines += [start, *(f"        {argument}," for argument in arguments), "    )"]
        return lines

    return render


def signature(named_after: str = "", **types: str) -> Render:
    """Parameters of __init__; those after `named_after` by keyword alone."""

    def render(table: str) -> Lines:
        lines = []
        for option in schema_of(table).values():
            kind = type_of(option, types)
            lines.append(f"        {option.name}: {kind} = {literal(default_of(table, option))},")
            if option.name == named_after:
                lines.append("        *,")
        return lines

    return render


def document(table: str) -> Lines:
    """A table of a document."""
    lines = ["| option | default | expected | unit | meaning |", "| --- | --- | --- | --- | --- |"]
    for option in schema_of(table).values():
        cells = [
            f"`{option.name}`",
            f"`{literal(default_of(table, option))}`",
            option.expected + (' or `"auto"`' if default_of(table, option) == "auto" else ""),
            option.unit,
            option.meaning,
        ]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return lines


PACKAGE = "python/sdftrack/"
AUTO_TYPES = {
    "w_cutoff": 'float | Literal["auto"]',
    "init_D": 'ArrayLike | Literal["auto"]',
    "update_D": 'bool | Literal["auto"]',
}
# File, table, what makes its lines.
REGIONS: tuple[tuple[str, str, Render], ...] = (
    (PACKAGE + "options.py", "tracker", fields()),
    (PACKAGE + "reconstruction/options.py", "reconstruct", fields()),
    (PACKAGE + "contour/memory_options.py", "memory", fields(order="Order")),
    (PACKAGE + "contour/memory.py", "memory", signature("n_inputs", rule="Rule", order="Order")),
    (PACKAGE + "contour/lwpr.py", "lwpr", signature(**{name: AUTO_TYPES[name] for name in AUTO})),
    *(
        ("docs/options.md", table, document)
        for table in ("tracker", "reconstruct", "contour", "lwpr", "memory")
    ),
)


def with_region(text: str, begin: str, end: str, lines: Lines, name: str) -> str:
    """The text with `lines` between the line with `begin` and the next one with `end`."""
    rows = text.splitlines()
    first = next((i for i, row in enumerate(rows) if row.strip() == begin), None)
    if first is None or end not in [row.strip() for row in rows[first:]]:
        raise ValueError(f"{name}: expected the lines {begin!r} and {end!r}")
    last = next(i for i in range(first, len(rows)) if rows[i].strip() == end)
    return "\n".join([*rows[: first + 1], *lines, *rows[last:]]) + "\n"


def generated() -> dict[Path, str]:
    """Every file with its regions written anew."""
    texts: dict[Path, str] = {}
    for name, table, render in REGIONS:
        path = ROOT / name
        text = texts.get(path) or path.read_text(encoding="utf-8")
        marks = (
            (f"<!-- options: {table} -->", "<!-- options: end -->") if name.endswith(".md") else (BEGIN, END)
        )
        texts[path] = with_region(text, *marks, render(table), name)
    return texts


def outdated() -> list[str]:
    """The files that are not what the schema says."""
    return [
        str(path.relative_to(ROOT))
        for path, text in generated().items()
        if path.read_text(encoding="utf-8") != text
    ]


def main(arguments: list[str]) -> int:
    old = outdated()
    if "--check" in arguments:
        for name in old:
            print(f"{name} is out of date: run python bindings/generate_options.py", file=sys.stderr)
        return 1 if old else 0
    for path, text in generated().items():
        if str(path.relative_to(ROOT)) in old:
            path.write_text(text, encoding="utf-8")
            print(path.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
