# SPDX-License-Identifier: MIT
"""Text in CSV files: no spreadsheet takes a name for a formula, and names come back as they were."""

import csv
import io

import numpy as np
import pytest
from motion_cases import noisy, reaches
from scipy.spatial.transform import Rotation

from sdftrack import motion
from sdftrack._internal.text_files import cell_text, text_cell

HOSTILE = [
    "=cmd|' /C calc'!A0", '=HYPERLINK("http://evil.example.com","a")', "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n=1",
    "＝1", "'=1", "''-1", "=", "x,=1+1", '"=1', "cup\r=1",
]  # fmt: skip
PLAIN = ["cup", "'tis", "'", "", "a=b", "1-2", "left hand", 'a "big" cup', "a,b"]
FORMULA = tuple("=+-@\t\r\n＝")


def cells(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text, newline="")))


def no_formulas(text: str) -> None:
    """No cell begins as a formula, except numbers; also where commas within quotes are taken for separators."""
    for row in cells(text):
        for cell in row:
            try:
                float(cell)
            except ValueError:
                assert not cell.startswith(FORMULA), cell


@pytest.mark.parametrize("text", HOSTILE + PLAIN)
def test_text_comes_back_and_is_never_a_formula(text):
    row = cells(f"{text_cell(text)},{text_cell('next')}\n")
    assert [[cell_text(cell) for cell in each] for each in row] == [[text, "next"]]
    assert not row[0][0].startswith(FORMULA)
    if text in PLAIN:
        assert row[0][0] == text


def cup(name, seed=0):
    times = np.arange(150) / 30
    turned = Rotation.from_rotvec(np.outer(np.linspace(0, 0.4, len(times)), [0, 0, 1.0]))
    return noisy(times, reaches(times, (1.0,), (0.25, -0.1, 0.0)), turned, seed=seed, name=name)


def test_trajectories_keep_hostile_names_and_frames(tmp_path):
    given = [cup(name, seed) for seed, name in enumerate(HOSTILE)]
    motion.save(tmp_path / "all.csv", given)
    no_formulas((tmp_path / "all.csv").read_bytes().decode())
    back = motion.load(tmp_path / "all.csv")
    assert [t.name for t in back] == HOSTILE
    for a, b in zip(given, back, strict=True):
        np.testing.assert_array_equal(a.times_s, b.times_s)
        np.testing.assert_allclose(a.poses, b.poses, atol=1e-12)  # through a quaternion
    assert (np.stack([t.poses for t in back])[..., :3, 3] < 0).any()  # negative numbers stay numbers
