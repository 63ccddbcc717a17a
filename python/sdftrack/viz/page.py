# SPDX-License-Identifier: MIT
"""``report.html``: pages without scripts and without a network, and that of a tracked sequence."""

from __future__ import annotations

import itertools
from array import array
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack.results import TrackResult

COLORS = {"ok": "#2e8b57", "weak": "#d9a520", "bad_frame": "#b9bfc4", "lost": "#b3392f"}  # best first
Array = NDArray[np.float64]
STATUS = tuple(COLORS)
INK, BLUE = "#24323d", "#2b6cb0"
WIDTH, HEIGHT, STRIP = 860.0, 110.0, 14.0
COLUMNS = 430  # of a plot: a long sequence is drawn by the worst status and the mean of a column
RUNS = 40  # lines of the table of an object


def html_page(title: str, body: str, note: str = "") -> str:
    from sdftrack import __version__

    style = Path(__file__).with_name("page.css").read_text("utf-8")
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width"><style>\n{style}</style></head>\n<body>\n{body}'
        f'\n<footer><p class="quiet">Made by sdftrack {escape(__version__)}.{note}</p></footer>\n</body></html>\n'
    )


def table(head: Sequence[str], rows: Sequence[Sequence[str]], kind: str = "") -> str:
    """A table of HTML cells; the first column is a heading of its row."""
    cells = "".join(f'<th scope="col">{h}</th>' for h in head)
    lines = "".join(
        f'<tr><th scope="row">{row[0]}</th>' + "".join(f"<td>{c}</td>" for c in row[1:]) + "</tr>\n"
        for row in rows
    )
    return f'<table class="{kind}"><thead><tr>{cells}</tr></thead><tbody>\n{lines}</tbody></table>'


class History:
    """What the page shows of one object, in 25 bytes for each frame that has it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.ids = array("q")  # the images' numbers
        self.status = bytearray()  # positions in STATUS
        self.numbers = array("f")  # confidence and position (m) of each frame
        self.without_pose: list[Run] = []
        self.weak = Counter[str]()  # frames by reason

    def add(self, result: TrackResult, k: int, im_id: int) -> None:
        status, reason = str(result.status[k]), str(result.reason[k])
        last = self.without_pose[-1] if self.without_pose else None
        if status == "weak":
            self.weak[reason] += 1
        elif status != "ok" and last and self.status[-1] == STATUS.index(status):
            last.last = im_id
        elif status != "ok":
            self.without_pose.append(Run(status, reason, im_id, im_id))
        self.ids.append(im_id)
        self.status.append(STATUS.index(status))
        self.numbers.extend((result.confidence[k], *result.poses[k, :3, 3]))


@dataclass
class Run:
    """Consecutive frames without a pose; the reason is that of the first."""

    status: str
    reason: str
    first: int
    last: int

    @property
    def images(self) -> str:
        return f"image {self.first}" if self.first == self.last else f"images {self.first} to {self.last}"


def run_page(title: str, objects: Sequence[History], frames: int, milliseconds: float, video: str) -> str:
    """The page of a tracked sequence; `video`: the name of a file beside the page, or nothing."""
    body = [f"<header><h1>{escape(title)}</h1>"]
    body.append(f'<p class="quiet">{frames} frames, median {milliseconds:.2f} ms</p></header>')
    if video:
        body.append(f'<video src="{escape(video)}" controls muted style="max-width: 100%"></video>')
    for one in objects:
        body += [f"<section><h2>{escape(one.name)}</h2>", *_object(one), "</section>"]
    body.append('<p class="quiet">Every pose with its covariance: report.json beside this page.</p>')
    return html_page(title, "\n".join(body))


def _object(one: History) -> list[str]:
    tiles = "".join(
        f'<div class="tile"><b style="color: {color}">{100 * n / len(one.ids):.1f} %</b>'
        f"<span>{name.replace('_', ' ')}: {n}</span></div>"
        for i, (name, color) in enumerate(COLORS.items())
        if (n := one.status.count(i))
    )
    out = [f'<div class="tiles">{tiles}</div>', _plot(one)]
    if one.weak:
        reason, _ = one.weak.most_common(1)[0]
        out.append(f'<p class="note">Weak in {one.weak.total()} frames, mostly because {escape(reason)}.</p>')
    rows = [[r.images, r.status.replace("_", " "), escape(r.reason)] for r in one.without_pose[:RUNS]]
    out += [table(["without a pose", "status", "reason"], rows)] if rows else []
    if len(one.without_pose) > RUNS:
        out.append(f'<p class="quiet">and {len(one.without_pose) - RUNS} more, see report.json</p>')
    return out


def _plot(one: History) -> str:
    """Confidence and distance from the first position; below them a strip with the status of each frame."""
    columns = np.array_split(np.arange(len(one.ids)), min(COLUMNS, len(one.ids)))
    step = WIDTH / len(columns)
    worst = [max(one.status[i] for i in part) for part in columns]
    strip, x = [], 0.0
    for status, run in itertools.groupby(worst):
        width = step * len(list(run))
        strip.append(
            f'<rect x="{x:.1f}" y="{HEIGHT:.0f}" width="{width:.1f}" height="{STRIP:.0f}" '
            f'fill="{COLORS[STATUS[status]]}"/>'
        )
        x += width
    numbers = np.array(one.numbers, np.float64).reshape(-1, 4)
    positions = numbers[:, 1:]
    seen = positions[np.isfinite(positions).all(1)]
    moved = np.linalg.norm(positions - seen[:1].sum(0), axis=1) + (0 if len(seen) else np.nan)
    farthest = float(np.nanmax(moved)) if len(seen) else 0.0
    lines = _line(numbers[:, 0], columns, 1.0, INK) + _line(moved, columns, farthest or 1.0, BLUE)
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {HEIGHT + STRIP:.0f}" role="img" aria-label="confidence, position and status '
        f'of each frame">{lines}{"".join(strip)}</svg><p class="quiet"><span style="color: {INK}">Confidence, 0 to '
        f'1</span>; <span style="color: {BLUE}">distance from the first position, 0 to {1e3 * farthest:.0f} mm</span>; '
        f"below: status of the images {one.ids[0]} to {one.ids[-1]}.</p>"
    )


def _line(values: Array, columns: Sequence[NDArray[np.int64]], top: float, color: str) -> str:
    """A path through the means of the columns, with gaps where there are none."""
    step, path, down = WIDTH / len(columns), [], False
    for n, part in enumerate(columns):
        known = values[part][np.isfinite(values[part])]
        if len(known):
            y = HEIGHT - 4 - (HEIGHT - 8) * known.mean() / top
            path.append(f"{'L' if down else 'M'}{step * (n + 0.5):.1f} {y:.1f}")
        down = len(known) > 0
    return f'<path d="{"".join(path)}" fill="none" stroke="{color}" stroke-linecap="round"/>'
