# SPDX-License-Identifier: MIT
"""`sdftrack reproduce` runs the figures of a source checkout, and says where to get one."""

import json

import pytest

from sdftrack.cli.app import run


def test_the_command_runs_the_figures_of_a_checkout(capfd, tmp_path, monkeypatch):
    assert run(["reproduce", "--list"]) == 0
    assert capfd.readouterr().out.startswith("3.5 ")
    assert run(["reproduce", "9.99"]) == 2
    assert "expected one of 3.5, 3.6" in capfd.readouterr().err
    assert run(["reproduce", "3.10", "--mesh", "/nowhere.ply", "--out", str(tmp_path / "o")]) == 1
    assert "no such file" in capfd.readouterr().err


def test_without_a_checkout_the_command_says_in_one_line_where_to_get_it(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sdftrack.cli.reproduce.__file__", str(tmp_path / "a/b/c/reproduce.py"))
    assert run(["reproduce", "3.10"]) == 1
    (line,) = capfd.readouterr().err.splitlines()
    assert "source checkout" in line


@pytest.mark.slow
def test_a_figure_is_three_files_in_a_folder_of_its_own(tmp_path, capfd):
    assert run(["reproduce", "3.10", "--short", "--threads", "1", "--out", str(tmp_path)]) == 0
    out = tmp_path / "3.10"
    assert {p.name for p in out.iterdir()} == {"figure.png", "table.txt", "result.json"}
    assert "all below 1 mm and 2 deg" in capfd.readouterr().out
    result = json.loads((out / "result.json").read_text())
    assert result["figure"] == "3.10"
    assert [round(row["sigma_mm"], 2) for row in result["levels"]] == [0.0, 1.0, 2.0, 3.16]
    assert result["levels"][1]["kept"] is result["levels"][3]["kept"] is True
    assert run(["reproduce", "3.10", "--short", "--out", str(tmp_path), "-q"]) == 1
