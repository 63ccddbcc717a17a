# SPDX-License-Identifier: MIT
"""docs/motion.md lists the measures as they are defined."""

import re
from pathlib import Path

from sdftrack.motion import DEFINITIONS

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "motion.md").read_text(encoding="utf-8")


def limit(d):
    """Widest interval that is still determined."""
    if d.relative:
        return f"{100 * d.wide:g} %"
    return f"{d.wide:g}" if d.unit == "1" else f"{d.wide:g} {d.unit}"


def row(d):
    cells = [f"`{d.name}`", d.label, d.unit, d.of, d.text, d.source, limit(d)]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def test_the_table_has_every_measure_as_it_is_defined_and_no_other():
    _, _, table = PAGE.partition("| name | label | unit |")
    rows = re.findall(r"^\| `\w+` \|.*", table.partition("\n\n")[0], re.MULTILINE)
    assert rows == [row(d) for d in DEFINITIONS.values()]
