# SPDX-License-Identifier: MIT
"""The documentation site has every page, every public name and every command; Sphinx itself is not needed here."""

import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

import sdftrack

DOCS = Path(__file__).resolve().parents[2] / "docs"
MODULES = [name for name in sdftrack.__all__ if type(getattr(sdftrack, name)).__name__ == "module"]
DIRECTIVE = re.compile(r"^\.\. auto(\w+):: sdftrack\.([\w.]+)", re.MULTILINE)


@pytest.fixture
def extensions(monkeypatch):
    """Brings a module of docs/_ext; those that need no Sphinx can be imported here."""
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    before = set(sys.modules)
    yield import_module
    for name in set(sys.modules) - before:
        if name in {"command_line", "contents", "repository"}:
            del sys.modules[name]


def member(name):
    module, _, attribute = name.rpartition(".")
    if name in MODULES:
        return import_module(f"sdftrack.{name}")
    return getattr(import_module(f"sdftrack.{module}".rstrip(".")), attribute)


def documented():
    """The names that the pages of the API document, as they are written there."""
    pages = "\n".join(path.read_text(encoding="utf-8") for path in sorted((DOCS / "api").glob("*.md")))
    return [(kind, name) for kind, name in DIRECTIVE.findall(pages)]


def public_names():
    names = {name for name in sdftrack.__all__ if name not in MODULES}
    return names | {
        f"{module}.{name}" for module in MODULES for name in import_module(f"sdftrack.{module}").__all__
    }


def test_every_public_name_is_in_the_reference():
    named = [name for _, name in documented()]
    objects = {id(member(name)) for name in named if name != "__version__"}
    missing = [name for name in public_names() - set(named) if id(member(name)) not in objects]
    assert sorted(missing) == []  # add an eval-rst block to a page of docs/api


def test_every_public_module_is_in_the_reference():
    assert sorted(set(MODULES) - {name for kind, name in documented() if kind == "module"}) == []


def test_the_reference_names_nothing_else_and_nothing_twice():
    names = [name for _, name in documented()]
    assert sorted(set(names) - public_names() - set(MODULES)) == []
    assert sorted({name for name in names if names.count(name) > 1}) == []


def test_every_page_of_the_reference_is_linked():
    linked = set(re.findall(r"\]\((\w+)\.md\)", (DOCS / "api" / "index.md").read_text(encoding="utf-8")))
    assert linked == {path.stem for path in (DOCS / "api").glob("*.md")} - {"index"}


def test_the_command_line_reference_has_every_command_and_option(extensions):
    from sdftrack.cli.app import parser

    text = extensions("command_line").reference()
    top = parser().commands
    paths = {name for name in top if name != "calibrate"} | {
        f"calibrate {n}" for n in top["calibrate"].commands
    }
    assert set(re.findall(r"^## sdftrack (.*)$", text, re.MULTILINE)) == paths
    for option in ("--model M.ply", "--no-outline", "--symmetry auto\\|none\\|models_info.json"):
        assert option in text


def test_the_lists_of_the_index_become_the_navigation(extensions):
    contents = extensions("contents")
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    trees = re.findall(r"^:caption: (.*)$", contents.with_toctrees(text), re.MULTILINE)
    assert trees == re.findall(r"^## (.*)$", text, re.MULTILINE)
    assert contents.with_toctrees("# a\n\n## One\n[b](b/c.md), [d](d.ipynb)\n").endswith(
        "```{toctree}\n:hidden:\n:caption: One\n\nb/c\nd\n```\n"
    )
