# SPDX-License-Identifier: MIT
"""The table of the tests that are left to the night names what there is (tests/nightly.txt)."""

import ast
import fnmatch
from pathlib import Path

import pytest
import tiers


def tests_of(path: Path) -> list[str]:
    """Names of test functions and classes, and Class::test."""
    out = []
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            out.append(node.name)
        if isinstance(node, ast.ClassDef):
            out += [f"{node.name}::{f.name}" for f in node.body if isinstance(f, ast.FunctionDef)]
    return out


@pytest.mark.parametrize("file", sorted({line.split("::")[0] for line in tiers.lines()}))
def test_every_line_names_tests_that_there_are(file):
    path = tiers.TESTS / file
    assert path.is_file(), f"{file}: not there; take its lines out of tests/nightly.txt, or rename them"
    names = tests_of(path)
    for pattern in tiers.patterns(path):
        function = pattern.partition("[")[0]
        assert any(fnmatch.fnmatchcase(name, function) for name in names), f"{file}::{pattern}: no such test"


def test_a_file_and_a_pattern_are_nightly(monkeypatch):
    for cached in (tiers.whole_files, tiers.patterns):
        cached.cache_clear()
    monkeypatch.setattr(tiers, "lines", lambda: ("a.py", "b.py::test_long*", "b.py::test_each[huge-*]"))
    a, b = tiers.TESTS / "a.py", tiers.TESTS / "b.py"
    assert tiers.is_nightly(a, "test_any")
    assert tiers.is_nightly(b, "test_longer[3]")
    assert tiers.is_nightly(b, "test_each[huge-1]")
    assert not tiers.is_nightly(b, "test_each[small-1]")
    assert not tiers.is_nightly(tiers.TESTS / "c.py", "test_long")
    for cached in (tiers.whole_files, tiers.patterns):
        cached.cache_clear()
