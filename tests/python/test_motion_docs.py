# SPDX-License-Identifier: MIT
"""docs/motion.md lists the measures as they are defined, and its example and the how-to run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import sdftrack as st
from sdftrack.cli.app import run
from sdftrack.motion import DEFINITIONS, Trajectory

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "motion.md").read_text(encoding="utf-8")
CODE = re.compile(r"^```(python|bash)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def limit(d):
    """Widest interval that is still determined."""
    if d.relative:
        return f"{100 * d.wide:g} %"
    return f"{d.wide:g}" if d.unit == "1" else f"{d.wide:g} {d.unit}"


def row(d):
    cells = [f"`{d.name}`", d.label, d.unit, d.of, d.text, d.source, limit(d)]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


@pytest.mark.parametrize("name", DEFINITIONS)
def test_the_table_has_every_measure_as_it_is_defined(name):
    assert row(DEFINITIONS[name]) in PAGE.splitlines()


def test_the_table_has_no_other_measure():
    _, _, table = PAGE.partition("| name | label | unit |")
    names = re.findall(r"^\| `(\w+)` \|", table.partition("\n\n")[0], re.MULTILINE)
    assert names == list(DEFINITIONS)


def test_the_ten_lines_of_the_page_run(tmp_path, monkeypatch, capsys):
    made = st.synth.exercise("reach", seed=3, repetitions=2)
    rng = np.random.default_rng(0)
    poses = made.poses()
    poses[:, :3, 3] += rng.normal(0, 0.001, (len(poses), 3))
    covariances = np.tile(np.diag(np.repeat([1e-3, 1e-2], 3) ** 2), (len(poses), 1, 1))
    cup = Trajectory(made.times_s, poses, covariances, name="cup")
    monkeypatch.chdir(tmp_path)
    st.motion.save("result.csv", cup)

    code = next(code for language, code in CODE.findall(PAGE) if language == "python")
    exec(compile(code.replace('"result"', '"result.csv"'), "motion.md", "exec"), {})

    said = capsys.readouterr().out
    assert "repetitions: 2 (2 to 2)" in said
    assert "not determined" not in said
    assert len(re.findall(r"^[\d.]+ s: \d+ mm \(\d+ to \d+\)$", said, re.MULTILINE)) == 2


@pytest.mark.slow
def test_an_exercise_step_by_step(tmp_path, monkeypatch, capsys):
    """As tests/python/test_howtos.py does it, with fewer frames."""
    monkeypatch.chdir(tmp_path)
    text = (DOCS / "howto" / "exercise.md").read_text(encoding="utf-8")
    text = text.replace("--repetitions 5", "--repetitions 2 --fps 15")
    names = {"__name__": "howto"}
    for language, code in CODE.findall(text):
        if language == "python":
            exec(compile(code, "exercise.md", "exec"), names)
            continue
        for line in code.splitlines():
            command, *arguments = shlex.split(line, comments=True)
            assert command == "sdftrack"
            assert run(arguments) == 0, line
    assert "2 repetitions (2 to 2)" in capsys.readouterr().out
    for folder in ("measured", "corrected", "compared"):
        assert (Path(folder) / "report.html").is_file()
    assert "Changes since" in Path("compared/report.html").read_text(encoding="utf-8")
    assert {p.suffix for p in Path("exported").glob("trajectory*")} == {".csv", ".sto", ".trc"}
