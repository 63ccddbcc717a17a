# SPDX-License-Identifier: MIT
"""The table of the tests that are left to the night names what there is (tests/nightly.txt)."""

import ast
import fnmatch
from pathlib import Path

import tiers


def names_in(path: Path) -> list[str]:
    """Names of test functions and classes, and Class::test."""
    out = []
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            out.append(node.name)
        if isinstance(node, ast.ClassDef):
            out += [f"{node.name}::{f.name}" for f in node.body if isinstance(f, ast.FunctionDef)]
    return out


def is_there(line):
    file, _, pattern = line.removeprefix(tiers.BUT).partition("::")
    names = [name for path in tiers.TESTS.glob(file) for name in names_in(path)]
    return any(fnmatch.fnmatchcase(name, pattern.partition("[")[0] or "*") for name in names)


def test_every_line_names_tests_that_there_are():
    gone = [line for line in tiers.lines() if not is_there(line)]
    assert gone == [], "not there: take these lines out of tests/nightly.txt, or rename what they name"
