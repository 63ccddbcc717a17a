# SPDX-License-Identifier: MIT
"""The report of an exercise: JSON of its schema, CSV, and a page that needs neither a network nor a script."""

import csv
import dataclasses
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from motion_cases import noisy, reaches

from sdftrack import motion
from sdftrack.motion import report
from sdftrack.motion.report.sessions import sessions_html
from sdftrack.motion.report.words import date_of

SCHEMA = json.loads((Path(__file__).parents[2] / "docs/reference/motion.schema.json").read_text())
TIMES = np.arange(330) / 30
STARTS = (1.0, 4.0, 7.5)
EVIL = 'cup <script>alert("x")</script> & "saucer"'
UP = (0.0, -1.0, 0.0)
VOID = {"meta", "br", "img", "link", "input", "hr"}


def recorded(seed=0, away_m=(0.25, -0.1, 0.0), starts=STARTS, name="cup", start_s=0.0, **fields):
    return noisy(TIMES + start_s, reaches(TIMES, starts, away_m), seed=seed, name=name, **fields)


def analyzed(*, up=UP, trajectory=None, **fields):
    return motion.analyze(recorded(**fields) if trajectory is None else trajectory, up=up)


@pytest.fixture(scope="module")
def cup():
    return analyzed()


@pytest.fixture(scope="module")
def sessions(cup):
    return {"May": [cup], "June": [analyzed(seed=1)], "July": [analyzed(seed=2, away_m=(0.35, -0.1, 0.0))]}


@pytest.fixture(scope="module")
def with_a_gap():
    status = np.where((TIMES > 4.2) & (TIMES < 5.0), "lost", "ok").tolist()
    return analyzed(status=status, name=EVIL)


def with_average(a, name, **changes):
    """The analysis with one average changed."""
    changed = dataclasses.replace(a.averages[name], **changes)
    return dataclasses.replace(a, averages={**a.averages, name: changed})


class Checker(HTMLParser):
    """Elements that are opened are closed, in order; tags, attributes and text are kept."""

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.attributes, self.text = [], set(), [], []
        self.feed(page)
        assert not self.open, self.open

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes += attrs

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def words(page):
    """The text of the page, without style."""
    return " ".join(" ".join(Checker(re.sub(r"<style.*?</style>", "", page, flags=re.S)).text).split())


# -- JSON
def valid(content):
    """As it is after a round trip through JSON without NaN."""
    content = json.loads(json.dumps(content, allow_nan=False))
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.validate(content, SCHEMA)
    return content


def test_measures_json_keeps_to_its_schema(sessions, with_a_gap):
    changes = report.compare_sessions(sessions)
    content = valid(report.measures_json(sessions, changes, {"by": "auto"}, notes=["a note"]))
    assert [s["name"] for s in content["sessions"]] == ["May", "June", "July"]
    assert len(content["changes"]) == len(changes) > 0
    assert set(content["definitions"]) == set(motion.DEFINITIONS)
    pairs = {"one": report.pairs_of([sessions["May"][0], analyzed(seed=5, name="spoon")])}
    (session,) = valid(report.measures_json({"one": sessions["May"]}, pairs=pairs))["sessions"]
    assert session["pairs"][0]["objects"] == ["cup", "spoon"]
    (gap,) = valid(report.measures_json({"one": [with_a_gap]}))["sessions"][0]["objects"][0]["gaps_s"]
    assert gap == pytest.approx([4.2, 5.0], abs=0.05)


def test_the_schema_refuses_what_it_does_not_describe(cup):
    content = report.measures_json({"one": [cup]})
    with pytest.raises(jsonschema.ValidationError, match="surprise"):
        jsonschema.validate({**content, "surprise": 1}, SCHEMA)


# -- CSV
def test_the_table_has_empty_cells_where_nothing_is_known(with_a_gap):
    rows = list(csv.DictReader(report.measures_csv({"one": [with_a_gap]}).splitlines()))
    assert {row["object"] for row in rows} == {EVIL}
    across = [row for row in rows if float(row["gap_s"]) > 0]
    assert across
    assert {row["path_length_m"] for row in across} == {""}
    assert all(row["path_length_m"] for row in rows if row not in across)


# -- Sessions
def test_what_one_session_did_not_determine_is_not_compared(cup, sessions):
    vague = with_average(cup, "reach", determined=False, note="too wide")
    names = {c.name for c in report.compare_sessions({"May": [vague], "July": sessions["July"]})}
    assert "reach" not in names
    assert "path_length" in names


def test_objects_of_the_same_name_are_compared_whatever_their_order(cup):
    spoon = analyzed(seed=4, name="spoon", away_m=(0.1, 0.0, 0.0))
    changes = report.compare_sessions({"May": [cup, spoon], "June": [spoon, cup]})
    assert {c.object for c in changes} == {"cup", "spoon"}
    assert not any(c.shown for c in changes)


def test_one_repetition_in_a_session_gives_no_comparison_and_says_so(cup):
    single = analyzed(seed=1, starts=(1.0,))
    pair = {"May": [cup], "June": [single]}
    assert report.compare_sessions(pair) == []
    assert "two repetitions or more" in words(sessions_html(pair, []))


# -- Pairs
def test_hands_in_step_have_no_lag_and_the_later_one_has_its_own(cup):
    for delay in (0.0, 0.15, -0.15):
        other = analyzed(seed=7, name="other", starts=[s + delay for s in STARTS])
        (pair,) = report.pairs_of([cup, other])
        lag = {m.name: m for _, m in pair.values}["pair_lag"]
        assert lag.value == pytest.approx(delay, abs=0.01)
        assert lag.low - 0.005 < delay < lag.high + 0.005


def test_the_distance_of_two_objects_is_measured(cup):
    path = reaches(TIMES, STARTS, (0.25, -0.1, 0.0)) + np.array([0, 0.3, 0])
    beside = noisy(TIMES, path, seed=8, name="beside")
    (pair,) = report.pairs_of([cup, analyzed(trajectory=beside)])
    values = {m.name: m for _, m in pair.values}
    assert values["pair_distance"].value == pytest.approx(0.3, abs=2e-3)
    assert values["pair_distance_range"].value < 0.01


def test_objects_that_are_never_seen_together_are_no_pair(cup):
    assert report.pairs_of([cup, analyzed(start_s=100.0, name="later")]) == []
    assert report.pairs_of([cup]) == []


# -- The page
def test_the_page_is_one_file_without_scripts_and_addresses(sessions):
    page = report.report_html(sessions, report.compare_sessions(sessions))
    checker = Checker(page)
    assert not checker.tags & {"script", "link", "img", "iframe", "object", "image"}
    assert not [a for a, _ in checker.attributes if a.startswith("on")]
    loaded = [
        v for a, v in checker.attributes if a in ("src", "href", "xlink:href") and not v.startswith("#")
    ]
    assert loaded == []
    assert "@import" not in page
    assert not re.search(r"url\((?!#)", page)
    assert len(page) < 1.5e6


def test_names_are_escaped_wherever_they_stand(with_a_gap):
    page = report.report_html(
        {"<b>May</b>": [with_a_gap], "<i>June</i>": [with_a_gap]},
        title=f"Exercise with {EVIL}",
        notes=["<u>note</u>"],
    )
    checker = Checker(page)
    assert "script" not in checker.tags
    assert not checker.tags & {"i", "u"}
    assert "<b>May" not in page
    assert EVIL in " ".join(checker.text)


def test_a_date_is_told_where_the_clock_is_that_of_the_day(cup):
    assert date_of(cup.trajectory) == ""
    assert date_of(recorded(start_s=1778572800.0)) == "2026-05-12 08:00 UTC"


def test_a_measure_that_is_not_determined_has_no_number_but_advice(cup):
    vague = with_average(
        cup, "reach", value=0.123456, low=0.0, high=1.0, determined=False, note="move nearer"
    )
    page = report.report_html({"one": [vague]})
    text = words(page)
    assert "Not determined: Reach – move nearer" in text
    assert "Reach not determined move nearer" in text
    averages = page.split("<h3>Averages</h3>")[1].split("<summary>Each repetition")[0]
    assert "123" not in averages


def test_many_sessions_are_split_into_tables_that_fit_a_page(cup):
    few = dataclasses.replace(cup, averages={n: cup.averages[n] for n in ("reach", "path_length")})
    many = {f"day {k}": [few] for k in range(8)}
    heads = re.findall(r"<thead>(.*?)</thead>", sessions_html(many, report.compare_sessions(many)))
    assert [h.count("day ") for h in heads] == [5, 4]
    assert all(">day 0<" in h for h in heads)


def test_a_page_without_repetitions_says_so():
    session = {"one": [analyzed(starts=())]}
    assert valid(report.measures_json(session))["sessions"][0]["objects"][0]["each"] == []
    text = words(report.report_html(session))
    assert "No repetition in 11.0 s: nothing moved by 30 mm" in text
    assert "Averages" not in text
