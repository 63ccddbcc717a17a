# SPDX-License-Identifier: MIT
"""The table of the tests that are left to the night names what there is (tests/nightly.txt)."""

import ast
import fnmatch
import re
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


def test_the_scripts_of_ci_name_files_that_there_are():
    for script in ("sanitize", "test_wheel.sh"):
        text = (tiers.TESTS.parent / ".ci" / script).read_text()
        lists = re.findall(r"^\w*tests=\(([\w\s]+)\)", text, re.M)
        assert lists, script
        gone = [
            n for names in lists for n in names.split() if not (tiers.TESTS / f"python/test_{n}.py").is_file()
        ]
        assert gone == [], script
