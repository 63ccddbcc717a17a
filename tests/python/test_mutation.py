# SPDX-License-Identifier: MIT
"""The table of seeded faults fits the core as it is (tests/mutation)."""

import importlib.util
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
SPEC = importlib.util.spec_from_file_location("mutation_run", TESTS / "mutation" / "run.py")
mutation = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(mutation)


def test_the_line_of_a_fault_is_in_its_file_once():
    lost = [fault["name"] for fault in mutation.faults() if len(mutation.places(fault, TESTS.parent)) != 1]
    assert lost == [], "change these faults in tests/mutation/faults.toml with their lines"
    assert all(fault["before"] != fault["after"] for fault in mutation.faults())
