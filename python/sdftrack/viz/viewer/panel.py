# SPDX-License-Identifier: MIT
"""The panel of the page: statuses, rates, confidence over time, and what the user can ask for."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from sdftrack.viz.overlay import STATUS_RGB
from sdftrack.viz.viewer.drawing import History, Shown, object_rgb

MAGNIFIED = 10.0  # position errors are below a millimetre, and would not be seen
STYLE = "padding:0.2em 0.9em; font-size:0.9em; line-height:1.5"
HELP = "Click the object in the image, or drag a box around it, to start it."


@dataclass(frozen=True)
class Click:
    """Start object `k` at this pixel of the depth image: ``tracker.recover(frame, k, ...)`` or ``start(clicks=)``."""

    k: int
    x_px: float
    y_px: float


@dataclass(frozen=True)
class Box:
    """Start object `k` in this rectangle of the depth image: left, top, width and height in pixels."""

    k: int
    x: float
    y: float
    w: float
    h: float


@dataclass(frozen=True)
class Pause:
    """Stop taking frames (`on`), or go on."""

    on: bool


@dataclass(frozen=True)
class Record:
    """Start (`on`) or end a recording."""

    on: bool


@dataclass(frozen=True)
class Save:
    """Save what there is now: the reconstruction, or the shown image."""


Request = Click | Box | Pause | Record | Save


class Panel:
    """Elements of viser's panel; `update` is called by the viewer's drawing thread only."""

    # `ask` is called with what the user asked for, `again` draws the last frame once more after a change of a setting;
    # `note` and, from the next `update` on, `message` are sentences shown above everything.

    def __init__(
        self,
        viser: Any,
        names: list[str],
        ask: Callable[[Request], None],
        again: Callable[[], None],
        note: str,
    ) -> None:
        self._gui = gui = viser.gui
        gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        if note:
            gui.add_html(f'<div style="{STYLE}">{html.escape(note)}</div>')
        self._rates = gui.add_html("")
        self._lines = gui.add_html("")
        self.message = ""
        self._names = list(names)
        self._plot: Any = None
        self._finished = False
        self._choice = gui.add_dropdown(
            "object to start", tuple(_labels(names)) or ("none",), hint=HELP, visible=bool(names)
        )
        self._pause = pause = gui.add_checkbox("pause", False)
        self._record = record = gui.add_checkbox("record", False)
        save = gui.add_button("save")
        self._magnified = gui.add_slider(
            "errors x", 1, 100, 1, MAGNIFIED,
            hint="Magnification of the ellipsoids, which show three standard deviations of the position.",
        )  # fmt: skip

        def then(work: Callable[[], None]) -> Callable[[Any], Any]:
            async def happened(_: Any) -> None:  # coroutines run in the order of the events
                work()

            return happened

        pause.on_update(then(lambda: ask(Pause(bool(pause.value)))))
        record.on_update(then(lambda: ask(Record(bool(record.value)))))
        save.on_click(then(lambda: ask(Save())))
        self._magnified.on_update(then(again))

    @property
    def chosen(self) -> int:
        """The object that a click starts; -1 without objects."""
        return _labels(self._names).index(self._choice.value) if self._names else -1

    @property
    def magnified(self) -> float:
        return float(self._magnified.value)

    def of_finished_run(self) -> None:
        """Leave out what concerns a running tracker."""
        self._finished = True
        self._choice.visible = self._pause.visible = self._record.visible = False

    def update(self, shown: Shown, history: History) -> None:
        rate = None if self._finished else history.rate_hz()
        self._rates.content = rates_html(rate, shown.latency_s, shown.dropped)
        heads = [text for text in (self.message, getattr(shown.frame, "error", ""), *shown.notes) if text]
        self._lines.content = lines_html(shown.result, shown.names, heads)
        times, *confidences = history.confidences(len(self._names))
        if len(times) < 2 or not confidences:
            return
        if self._plot is not None:
            self._plot.data = (times, *confidences)
            return
        lines = [
            {"label": name, "stroke": "rgb({},{},{})".format(*object_rgb(k)), "width": 2}
            for k, name in enumerate(self._names)
        ]
        grey = {"stroke": "#aaa", "grid": {"stroke": "#444"}}
        self._plot = self._gui.add_uplot(
            (times, *confidences), ({"label": "frame" if self._finished else "s"}, *lines),
            title="confidence", aspect=2.0,
            scales={"x": {"time": False}, "y": {"auto": False, "range": (0.0, 1.05)}}, axes=(grey, grey),
        )  # fmt: skip


def _labels(names: list[str]) -> list[str]:
    """Names as the dropdown shows them: all different."""
    return [f"{name} ({k})" if names.count(name) > 1 else name for k, name in enumerate(names)]


def rates_html(rate_hz: float | None, latency_s: float | None, dropped: int | None) -> str:
    """Frame rate, latency and dropped frames, those that are known."""
    told = []
    if rate_hz is not None:
        told.append(f"{rate_hz:.1f} frames/s")
    if latency_s is not None and math.isfinite(latency_s):
        told.append(f"latency {1e3 * latency_s:.0f} ms")
    if dropped is not None:
        told.append(f"{dropped} dropped")
    return f'<div style="{STYLE}">{", ".join(told)}</div>'


def lines_html(result: Any, names: list[str], heads: Sequence[str] = ()) -> str:
    """`heads`, and a line for each object: name, status, confidence, reason; all text is escaped."""
    lines = [f"<div>{html.escape(text)}</div>" for text in heads]
    for k, status in enumerate(result.status if result is not None else ()):
        dot = "rgb({},{},{})".format(*object_rgb(k))
        color = "rgb({},{},{})".format(*STATUS_RGB[str(status)])
        sure = "" if str(status) in ("lost", "bad_frame") else f" {float(result.confidence[k]):.2f}"
        lines.append(
            f'<div><span style="color:{dot}">&#9632;</span> {html.escape(names[k])}: '
            f'<b style="color:{color}">{html.escape(str(status).replace("_", " "))}{sure}</b> '
            f"{html.escape(str(result.reason[k]))}</div>"
        )
    return f'<div style="{STYLE}">{"".join(lines)}</div>'
