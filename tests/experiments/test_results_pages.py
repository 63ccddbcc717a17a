# SPDX-License-Identifier: MIT
"""The documents show what the records hold, and each experiment that they name has one."""

import argparse
import re
import shlex
from pathlib import Path

import pytest

from experiments import record, render
from experiments.options import add_options
from experiments.registry import all_experiments, find

ROOT = Path(__file__).resolve().parents[2]
COPIES = ROOT / "docs" / "project"  # made for the site, not in git
PAGES = [
    ROOT / "README.md",
    *(page for page in sorted((ROOT / "docs").rglob("*.md")) if not page.is_relative_to(COPIES)),
]
ROW = re.compile(r"^\|.*\|$", re.MULTILINE)
COMMAND = re.compile(r"python -m experiments run ([a-z][\w.]*\w)([^`#\n]*)")


def commands(text: str) -> list[tuple[str, str]]:
    """(name, options) of each command; ``several.CASE`` stands for several names."""
    return [(name, options) for name, options in COMMAND.findall(text) if not name.split(".")[-1].isupper()]


def experiments_of_tables(text: str) -> list[tuple[str, list[str]]]:
    """(row, names) of each row of the tables whose last column is "experiment" or "experiments"."""
    found, inside = [], False
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")] if ROW.match(line) else []
        if cells and cells[-1] in ("experiment", "experiments"):
            inside = True
        elif not cells:
            inside = False
        elif inside and not set(line) <= set("|-: "):
            found.append((line, re.findall(r"`([a-z][\w.]*)`", cells[-1])))
    return found


def named() -> set[str]:
    """Every experiment that a page names: in a block, a command, or a column of experiments."""
    names = set()
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        names |= {name for name, _ in render.blocks(text)}
        names |= {name for name, _ in commands(text)}
        names |= {name for _, found in experiments_of_tables(text) for name in found}
    return names


def test_pages_show_their_records():
    assert render.main(["--check"]) == 0


def test_every_experiment_that_is_named_has_a_record():
    assert sorted(named() - set(record.names())) == []


def test_every_record_is_shown_whole():
    shown = {block for page in PAGES for block in render.blocks(page.read_text(encoding="utf-8"))}
    held = {(name, table["id"]) for name in record.names() for table in record.load(name)["tables"]}
    assert sorted(held - shown) == []


def test_each_figure_of_the_readme_names_its_experiment():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    figures = text[text.index("## Figures") : text.index("## Where to read next")]
    rows = experiments_of_tables(figures)
    headed = sum("---" in line for line in ROW.findall(figures))
    assert len(rows) + 2 * headed == len(ROW.findall(figures))
    assert [row for row, names in rows if not names] == []


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "results").glob("*.md")), ids=lambda page: page.stem)
def test_each_page_says_which_data_were_used(page):
    assert "**Data.**" in page.read_text(encoding="utf-8")


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        raise ValueError(message)


def test_every_experiment_that_is_named_can_be_run():
    runnable = named() | set(record.names())
    retired = {name for name in record.names() if record.load(name).get("retired")}
    assert sorted(runnable - set(all_experiments())) == sorted(retired)


def test_the_commands_of_the_pages_have_options_that_exist():
    unknown = []
    for page in PAGES:
        for name, rest in commands(page.read_text(encoding="utf-8")):
            parser = _Parser()
            parser.add_argument("--data")
            add_options(parser, find(name).function)
            try:
                parser.parse_args(shlex.split(re.sub(r"[\[\]]", "", rest)))
            except ValueError as error:
                unknown.append(f"{page.name}: {name}: {error}")
    assert unknown == []


def test_the_page_of_figures_has_them_all():
    page = (ROOT / "docs/results/figures.md").read_text(encoding="utf-8")
    listed = [row.split("|")[1].strip() for row in ROW.findall(page)][2:]
    assert sorted(listed) == sorted(
        n.removeprefix("thesis.") for n in all_experiments() if n.startswith("thesis.")
    )
