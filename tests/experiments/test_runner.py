# SPDX-License-Identifier: MIT
"""Registry, options, runner and targets of the experiments, and that the installed package knows nothing of them."""

import json
import re
import tomllib
from pathlib import Path
from typing import Literal

import pytest

from experiments import targets
from experiments.__main__ import main, run
from experiments.figures import figures
from experiments.figures import main as figures_main
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import Experiment, all_experiments, find
from experiments.table import Table
from experiments.targets import Target, judge, targets_of

ROWS = [["a", "1.5 %"], ["b", "no"]]


def stones(
    *,
    data: Path,
    n: int = 3,
    height: float | None = None,
    only: tuple[str, ...] = ("granite",),
    ground: Literal["sand", "rock"] = "sand",
    wind: bool = False,
    options: Settings = NO_SETTINGS,
) -> Table:
    """How far stones fall.

    Parameters
    ----------
    n
        stones of each kind,
        at least one
    ground
        where they end
    """
    told = f"{n} {height} {','.join(only)} {ground} {wind} {dict(options)} {data.name}"
    return Table(told, ["stone", "fell"], ROWS, ["a note"], {"a": 1.5})


STONES = Experiment("stones", stones, ("quarry",), (), "one heap", "another", {"n": 1})


def test_every_experiment_has_a_summary_and_says_what_it_was_chosen_and_reported_on():
    for name, known in all_experiments().items():
        assert known.summary.endswith((".", "?")), name
        assert known.chosen_on, name
        assert known.reported_on, name


def test_options_come_from_the_signature_and_the_record_has_all_that_a_reader_needs(tmp_path, capsys):
    (tmp_path / "quarry").mkdir()
    places = f"--data {tmp_path} --out {tmp_path / 'made'}"
    run(STONES, f"{places} --n 5 --height 2 --only slate,flint --ground rock --wind --set spin=0.5".split())
    printed = capsys.readouterr().out
    assert f"5 2.0 slate,flint rock True {{'spin': 0.5}} {tmp_path.name}" in printed
    assert "a note" in printed
    record = json.loads((tmp_path / "made" / "stones.json").read_text())
    assert set(record["runs"][0]) == {"machine", "commit", "date", "settings", "seconds", "sources"}
    assert record["runs"][0]["settings"]["only"] == ["slate", "flint"]
    assert record["tables"][0]["rows"] == ROWS
    assert record["tables"][0]["numbers"] == {"a": 1.5}


def test_a_short_run_takes_the_short_options_and_records_nothing_unasked(tmp_path, capsys):
    (tmp_path / "quarry").mkdir()
    run(STONES, ["--data", str(tmp_path)], short=True)
    printed = capsys.readouterr().out
    assert printed.startswith("1 None granite")
    assert "recorded" not in printed


def test_targets_are_met_or_missed_by_rows():
    tables = [Table("falls", ["stone", "fell"], ROWS)]
    assert Target("a", "fell", row="a", max=2).met_by("1.5 %")
    assert not Target("a", "fell", min=2).met_by("no")
    assert Target("b", "fell", equals="no").met_by("no")
    assert (
        str(targets._judge_one(Target("falls", "fell", row="a", max=2), tables))
        == "target met: falls <= 2 (1 rows)"
    )
    drawn = Target("a hill", picture=True)
    assert not targets._judge_one(drawn, tables).rows
    assert targets._judge_one(drawn, [Table("hill", picture=lambda: None)]).rows == 1
    missed = targets._judge_one(Target("falls", "fell", max=1), tables)
    assert str(missed) == "target missed: falls <= 1: a (1.5 %), b (no)"
    assert "not measured" in str(targets._judge_one(Target("falls", "rose", max=1), tables))


def test_targets_are_read_from_their_file_and_belong_to_experiments(tmp_path):
    known = all_experiments()
    for name in tomllib.loads(targets.FILE.read_text()):
        found = targets_of(name) if "." in name or name in known else []
        assert name in known, name
        assert found, name
    wrong = tmp_path / "targets.toml"
    for entry, said in (
        ('column = "b"\nmost = 1', "most"),
        ('column = "b"', "a column with a limit"),
        ("picture = true\nmax = 1", "or picture = true"),
    ):
        wrong.write_text(f'[[stones]]\nfigure = "a"\n{entry}\n')
        with pytest.raises(ValueError, match=rf"targets.toml, stones: .*{said}"):
            targets_of("stones", wrong)
    assert judge("stones", []) == []


def test_every_figure_of_the_thesis_has_a_target_and_is_remade_or_named_with_a_reason():
    """A target is a claim that the source prints, or a picture that there is to be (`Target.picture`)."""
    known = {e.name: number for number, e in figures().items()}
    assert sorted(set(known) - set(tomllib.loads(targets.FILE.read_text()))) == []
    page = (Path(__file__).parents[2] / "docs" / "results.md").read_text()
    left_out = page[page.index("**Left out**") :].partition("\n\n")[0]
    named = {number.rstrip("ab") for number in known.values()}
    for chapter, first, last in re.findall(r"\b([1-7A])\.(\d+)(?:-(\d+))?", left_out):
        named |= {f"{chapter}.{k}" for k in range(int(first), int(last or first) + 1)}
    counts = {"1": 9, "2": 11, "3": 16, "4": 16, "5": 13, "6": 11, "7": 1, "A": 5}
    assert {f"{chapter}.{k}" for chapter, n in counts.items() for k in range(1, n + 1)} - named == set()


def test_a_figure_is_refused_by_so_few_frames_that_its_claim_cannot_be_judged(capsys, tmp_path):
    fewest = find("thesis.4.16").short["frames"]
    assert figures_main(["4.16", "--frames", str(fewest - 1), "--out", str(tmp_path)]) == 2
    assert f"thesis.4.16: expected at least {fewest} frames" in capsys.readouterr().err
    assert main(["run", "thesis.4.16", "--frames", "30"]) == 1
    assert "got 30\n" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
