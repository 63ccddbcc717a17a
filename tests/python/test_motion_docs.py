# SPDX-License-Identifier: MIT
"""docs/motion.md lists the measures as they are defined, and its example runs."""

import re
from pathlib import Path

import numpy as np
from test_docs import code_blocks

import sdftrack as st
from sdftrack.motion import DEFINITIONS, Trajectory

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


def test_the_ten_lines_of_the_page_run(tmp_path, monkeypatch, capsys):
    made = st.synth.exercise("reach", seed=3, repetitions=2)
    rng = np.random.default_rng(0)
    poses = made.poses()
    poses[:, :3, 3] += rng.normal(0, 0.001, (len(poses), 3))
    covariances = np.tile(np.diag(np.repeat([1e-3, 1e-2], 3) ** 2), (len(poses), 1, 1))
    cup = Trajectory(made.times_s, poses, covariances, name="cup")
    monkeypatch.chdir(tmp_path)
    st.motion.save("result.csv", cup)

    code = code_blocks(DOCS / "motion.md", "python")[0]
    exec(compile(code.replace('"result"', '"result.csv"'), "motion.md", "exec"), {})

    said = capsys.readouterr().out
    assert "repetitions: 2 (2 to 2)" in said
    assert "not determined" not in said
    assert len(re.findall(r"^[\d.]+ s: \d+ mm \(\d+ to \d+\)$", said, re.MULTILINE)) == 2
