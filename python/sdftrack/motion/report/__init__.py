# SPDX-License-Identifier: MIT
"""The report of an exercise: numbers as JSON and CSV, and a page to read and print."""

from sdftrack.motion.report.numbers import measures_csv, measures_json
from sdftrack.motion.report.page import report_html
from sdftrack.motion.report.sessions import Change, compare_sessions

__all__ = ["Change", "compare_sessions", "measures_csv", "measures_json", "report_html"]
