# SPDX-License-Identifier: MIT
"""The report of an exercise: numbers as JSON and CSV, and a page to read and print."""

from sdftrack.motion.report.numbers import measures_csv, measures_json, repetitions_text, smoothed_csv
from sdftrack.motion.report.page import report_html
from sdftrack.motion.report.sessions import Change, compare_sessions
from sdftrack.motion.two_objects import Pair, pairs_of

__all__ = [
    "Change", "Pair", "compare_sessions", "measures_csv", "measures_json", "pairs_of", "repetitions_text",
    "report_html", "smoothed_csv",
]  # fmt: skip
