# SPDX-License-Identifier: MIT
"""The report of an exercise: JSON by its schema, CSV by its columns, and one page without a network."""

from __future__ import annotations

import csv
import io
import json
import re
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from motion_cases import noisy, reaches

from sdftrack import motion
from sdftrack.motion.report import compare_sessions, measures_csv, measures_json, report_html
from sdftrack.motion.report.numbers import repetitions_json

SCHEMA = Path(__file__).parents[2] / "docs" / "reference" / "motion.schema.json"
NASTY = '<script>alert("&")</script>'
UP = (0.0, 0.0, 1.0)
FIELDS = ["session", "object", "repetition", "start_s", "end_s", "gap_s"]


@cache
def analysis(name="cup", starts_s=(1.0, 4.5), seed=0, far_m=0.25, lost=(), hold_s=1.5, covariances=True):
    t = np.arange(9 * 30) / 30
    x = reaches(t, starts_s, (far_m, 0.1, 0.0), hold_s=hold_s)
    status = ["lost" if any(a < s < b for a, b in lost) else "ok" for s in t]
    trajectory = noisy(t, x, seed=seed, name=name, status=status)
    if not covariances:
        trajectory = motion.Trajectory(t, trajectory.poses, None, status, name)
    targets = [motion.Sphere([far_m, 0.1, 0.8], 0.05)]
    return motion.analyze(trajectory, up=UP, cues_s=[0.6], targets=targets, samples=60)


@pytest.fixture(scope="module")
def validate():
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema).validate


def strict(value):
    """As a program that knows no NaN reads it."""
    return json.loads(json.dumps(value, allow_nan=False))


SESSIONS = {
    "one": lambda: {"monday": [analysis()]},
    "nothing moves": lambda: {"monday": [analysis(starts_s=())]},
    "one repetition": lambda: {"monday": [analysis(starts_s=(1.0,))]},
    "a gap": lambda: {"monday": [analysis(lost=((1.2, 1.7),))]},
    "without covariances": lambda: {"monday": [analysis(covariances=False)]},
    "two objects": lambda: {"monday": [analysis(), analysis("box", seed=1)]},
    "two sessions": lambda: {"monday": [analysis()], "friday": [analysis(seed=1, far_m=0.35)]},
}


@pytest.fixture(params=SESSIONS)
def sessions(request):
    return SESSIONS[request.param]()


class TestJson:
    def test_it_is_as_the_schema_says(self, sessions, validate):
        validate(strict(measures_json(sessions, compare_sessions(sessions), {"results": ["a.txt"]})))

    def test_the_schema_refuses_what_is_left_out_or_added(self, validate):
        jsonschema = pytest.importorskip("jsonschema")
        whole = strict(measures_json({"monday": [analysis()]}))
        places = [
            lambda v: v,
            lambda v: v["sessions"][0],
            lambda v: v["sessions"][0]["objects"][0],
            lambda v: v["sessions"][0]["objects"][0]["averages"][0],
            lambda v: v["sessions"][0]["objects"][0]["each"][0],
            lambda v: v["sessions"][0]["objects"][0]["each"][0]["phases"][0],
            lambda v: v["sessions"][0]["objects"][0]["tremor"][0],
        ]
        for place in places:
            for key in list(place(whole)):
                changed = strict(whole)
                del place(changed)[key]
                with pytest.raises(jsonschema.ValidationError):
                    validate(changed)
            changed = strict(whole)
            place(changed)["surprise"] = 1
            with pytest.raises(jsonschema.ValidationError):
                validate(changed)

    def test_its_numbers_are_those_of_the_analysis(self):
        a = analysis()
        (found,) = strict(measures_json({"monday": [a]}))["sessions"][0]["objects"]
        assert found["repetitions"] == {"count": 2, "low": a.count[1], "high": a.count[2]}
        assert [m["name"] for m in found["averages"]] == list(a.averages)
        for r, row in zip(a.repetitions, found["each"], strict=True):
            assert (row["start_s"], row["end_s"], row["cue_s"]) == (r.span.start_s, r.span.end_s, r.cue_s)
            for m in row["measures"]:
                expected = r.values[m["name"]]
                for key in ("value", "low", "high"):
                    number = getattr(expected, key)
                    assert m[key] == (number if np.isfinite(number) else None)
                assert m["determined"] == expected.determined
        assert len(found["tremor"]) == len(a.tremors) == 2

    def test_every_measure_has_its_definition(self):
        value = measures_json({"monday": [analysis()]})
        names = set(value["definitions"])
        assert set(motion.DEFINITIONS) < names
        for m in value["sessions"][0]["objects"][0]["averages"]:
            assert re.sub("_(move|return)$", "", m["name"]) in names
        for d in value["definitions"].values():
            assert len(d["definition"]) > 20
            assert d["source"]

    def test_what_is_undefined_is_null(self):
        value = strict(measures_json({"monday": [analysis(lost=((1.2, 1.7),))]}))
        first = value["sessions"][0]["objects"][0]["each"][0]
        assert first["gap_s"] > 0.3
        by_name = {m["name"]: m for m in first["measures"]}
        assert by_name["path_length"]["value"] is None
        assert not by_name["path_length"]["determined"]

    def test_repetitions_are_start_and_end(self):
        a = analysis()
        assert repetitions_json(a) == {
            "object": "cup",
            "repetitions": [[r.span.start_s, r.span.end_s] for r in a.repetitions],
        }


def rows_of(text):
    return list(csv.DictReader(io.StringIO(text)))


class TestCsv:
    def test_there_is_one_row_per_repetition(self, sessions):
        rows = rows_of(measures_csv(sessions))
        expected = [
            (name, a.trajectory.name, str(k))
            for name, each in sessions.items()
            for a in each
            for k in range(1, len(a.repetitions) + 1)
        ]
        assert [(r["session"], r["object"], r["repetition"]) for r in rows] == expected
        assert all(None not in r and None not in r.values() for r in rows)

    def test_columns_name_the_unit_and_the_interval(self):
        head = measures_csv({"monday": [analysis()]}).splitlines()[0].split(",")
        assert head[:6] == FIELDS
        assert len(set(head)) == len(head) == 6 + 3 * len(analysis().repetitions[0].values)
        for name in (
            "path_length_m", "path_length_low", "path_length_high", "peak_speed_move_m_per_s", "sparc_move",
            "peak_acceleration_return_m_per_s2", "time_to_peak_speed_part_move_percent", "max_tilt_rad",
            "movement_time_move_s", "target1_time_s",
        ):  # fmt: skip
            assert name in head, name

    def test_cells_are_the_values(self):
        a = analysis()
        for r, row in zip(a.repetitions, rows_of(measures_csv({"monday": [a]})), strict=True):
            assert float(row["start_s"]) == pytest.approx(r.span.start_s, abs=1e-4)
            m = r.values["path_length"]
            assert m.determined
            assert [float(row[f"path_length_{k}"]) for k in ("m", "low", "high")] == pytest.approx(
                [m.value, m.low, m.high], rel=1e-8
            )

    def test_what_is_not_determined_has_an_interval_and_no_value(self):
        a = analysis()
        rows = rows_of(measures_csv({"monday": [a]}))
        seen = 0
        for r, row in zip(a.repetitions, rows, strict=True):
            for name, m in r.values.items():
                if m.unit == "rad/s" and not m.determined:  # the object does not turn
                    seen += 1
                    assert row[f"{name}_rad_per_s"] == ""
                    assert float(row[f"{name}_high"]) == pytest.approx(m.high)
        assert seen

    def test_what_is_undefined_is_empty(self):
        first = rows_of(measures_csv({"monday": [analysis(lost=((1.2, 1.7),))]}))[0]
        assert [first[f"path_length_{k}"] for k in ("m", "low", "high")] == ["", "", ""]

    def test_names_with_commas_and_quotes_come_back(self):
        rows = rows_of(measures_csv({'a,"b"': [analysis('cup, "red"\n')]}))
        assert {(r["session"], r["object"]) for r in rows} == {('a,"b"', 'cup, "red"\n')}


class Page(HTMLParser):
    """Tags and their attributes; complains of what is not closed."""

    VOID = frozenset({"meta", "br", "img", "hr", "path", "line", "circle", "rect", "polyline", "polygon"})

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.tags, self.attributes, self.open, self.words = [], [], [], []
        self.feed(text)
        self.close()
        assert not self.open, self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, *a) for a in attrs]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, *a) for a in attrs]

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self):
        return " ".join(self.words)


@pytest.mark.slow
class TestPage:
    def test_it_needs_no_network_and_runs_nothing(self, sessions):
        text = report_html(sessions, compare_sessions(sessions), title="Exercise", notes=["monday: out"])
        page = Page(text)
        assert not {"script", "link", "iframe", "object", "embed", "img", "base", "form"} & set(page.tags)
        for tag, name, value in page.attributes:
            if name in ("src", "href", "xlink:href", "action", "srcset"):
                assert value.startswith("#"), (tag, name, value)  # a part of this page
            assert not name.startswith("on"), (tag, name)
        without_namespaces = re.sub(r'xmlns(:\w+)?="[^"]*"', "", text)
        assert not re.search(r"https?:|//[a-z]|@import|url\((?!#)|javascript:", without_namespaces)
        assert text.startswith("<!DOCTYPE html>")
        assert 'charset="utf-8"' in text

    def test_there_is_no_nan_in_it(self, sessions):
        text = report_html(sessions, compare_sessions(sessions))
        assert not re.search(r"\b(nan|inf|None)\b", text)

    def test_names_are_escaped_wherever_they_appear(self):
        sessions = {
            NASTY: [analysis(NASTY)],
            f"{NASTY}2": [analysis(NASTY, seed=1, far_m=0.35)],
        }
        changes = compare_sessions(sessions)
        assert changes
        page = Page(report_html(sessions, changes, title=NASTY, notes=[NASTY]))
        assert "script" not in page.tags
        assert page.text.count(NASTY) > 5

    def test_it_says_how_many_repetitions_there_are(self):
        assert "2 repetitions in 9.0 s" in report_html({"monday": [analysis()]})
        assert "1 repetition in 9.0 s" in report_html({"monday": [analysis(starts_s=(1.0,))]})
        still = report_html({"monday": [analysis(starts_s=())]})
        assert "No repetition in 9.0 s" in still
        assert "svg" not in Page(still).tags

    def test_what_is_not_determined_is_said(self):
        a = analysis()
        missing = [m.name for m in a.averages.values() if not m.determined]
        assert "peak_angular_speed" in missing
        text = Page(report_html({"monday": [a]})).text
        assert "not determined" in text
        assert "Not determined: Peak angular speed" in text
        assert "the interval is too wide" in text

    def test_every_measure_has_its_value_interval_and_definition(self):
        a = analysis()
        text = Page(report_html({"monday": [a]})).text
        for d in a.definitions:
            assert d.text in text
            assert d.source in text
        m = a.averages["range_x"]
        assert re.search(rf"{1e3 * m.value:.0f}(\.\d+)? +mm|{1e3 * m.value:.0f}\.\d+ mm", text)

    def test_missing_covariances_and_lost_frames_are_said(self):
        text = Page(report_html({"monday": [analysis(covariances=False)]})).text
        assert "The poses came without covariances" in text
        assert "without covariances" not in report_html({"monday": [analysis()]})
        assert re.search(r"\d+ % lost", Page(report_html({"m": [analysis(lost=((1.2, 1.7),))]})).text)

    def test_changes_are_shown_or_not(self):
        sessions = {"monday": [analysis()], "friday": [analysis(seed=1, far_m=0.35)]}
        page = Page(report_html(sessions, compare_sessions(sessions)))
        assert "Changes since monday" in page.text
        assert "no change that the data show" in page.text
        assert "more" in page.words
        assert "Changes since" not in report_html({"monday": [analysis()]})

    def test_it_is_made_to_be_printed(self):
        assert "@media print" in report_html({"monday": [analysis()]})
