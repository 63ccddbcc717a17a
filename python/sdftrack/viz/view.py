# SPDX-License-Identifier: MIT
"""A recording with its results in the browser or in a notebook; a slider and a play button choose the frame."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from sdftrack.results import TrackResult
from sdftrack.viz.viewer import Viewer
from sdftrack.viz.viewer.drawer import Drawer

FPS = 30.0  # of a recording without timestamps
MAX_HZ = 1000.0  # of frames that the slider asks for


def view(
    seq_or_frame: Any,
    results: Sequence[TrackResult | None] | TrackResult | None = None,
    shapes: Any = None,
    *,
    camera: Any = None,
    names: Sequence[str] | None = None,
    meshes: Sequence[Any] | None = None,
    host: str = "localhost",
    port: int = 8080,
    token: str | None = None,
    block: bool = False,
) -> Viewer:
    """Show a recording with its results on a page in the browser: images, point cloud, models, errors; a time slider.

    In a notebook, the viewer as the last value of a cell shows the page there. Requires the extra ``viewer``.

    Parameters
    ----------
    seq_or_frame : Sequence or Frame
        A sequence is read frame by frame, when the slider moves; it must stay open.
    results : list of TrackResult or None, or one, optional
        One per frame; None where a frame has none.
    shapes : SDF, Mesh, or list of them, optional
        The tracked shapes. Default: the models of the sequence, in the order of its objects.
    camera : Camera or RGBDCamera, optional
        Default: that of the sequence or the frame.
    names, meshes, host, port, token
        As for ``sdftrack.viz.viewer.Viewer``.
    block : bool
        Wait until Ctrl-C, for scripts that would end otherwise; the viewer returned is closed then.

    Returns
    -------
    Viewer
        With ``url``; close it by ``close`` or ``with``.

    Raises
    ------
    ImportError
        viser is not installed.
    ValueError
        Numbers of results and frames differ, results without shapes, a frame without a camera.

    Examples
    --------
    >>> viewer = st.view(sequence, results, sdf)  # doctest: +SKIP
    >>> print(viewer.url)  # doctest: +SKIP
    """
    single = not hasattr(seq_or_frame, "__len__")
    frames = [seq_or_frame] if single else seq_or_frame
    many: list[TrackResult | None] = (
        [None] * len(frames)
        if results is None
        else [results]
        if isinstance(results, TrackResult)
        else list(results)
    )
    if len(many) != len(frames):
        raise ValueError(f"results: expected {len(frames)}, one per frame, got {len(many)}")
    for i, result in enumerate(many):
        if not isinstance(result, TrackResult | None):
            raise TypeError(f"results[{i}]: expected TrackResult or None, got {type(result).__name__}")
    camera = getattr(seq_or_frame, "camera", None) if camera is None else camera
    if camera is None:
        raise ValueError("camera: expected the camera of the frame, got none; pass camera=")
    count = max((len(r.poses) for r in many if r is not None), default=0)
    known = _shapes_of(seq_or_frame, count) if shapes is None else shapes

    viewer = Viewer(known, camera, names, meshes, host=host, port=port, token=token)
    viewer._history.fill(many)
    viewer._panel.of_finished_run()
    Playback(viewer, len(frames), lambda i: viewer.show(frames[i], many[i]), _fps(frames))
    if block:
        try:
            viewer.wait()
        except KeyboardInterrupt:
            pass
        finally:
            viewer.close()
    return viewer


def _shapes_of(seq: Any, count: int) -> list[Any]:
    """The models of the sequence's first `count` objects."""
    models = getattr(seq, "models", None) or {}
    objects = list(getattr(seq, "objects", ()))[:count]
    if len(objects) < count or any(o not in models for o in objects):
        raise ValueError(
            f"shapes: expected the {count} tracked shapes, got none, and the sequence has no models"
        )
    return [models[o] for o in objects]


def _fps(frames: Any) -> float:
    if len(frames) < 2:
        return FPS
    a, b = frames[0].timestamp, frames[1].timestamp
    return 1 / (b - a) if a is not None and b is not None and 1e-3 < b - a < 1 else FPS


class Playback:
    """A slider and a play button for `count` frames; a thread loads the frame that was asked for last."""

    # `show(i)` loads frame i and hands it to the viewer, in that thread only. `index` is the frame shown last, -1
    # before the first. Closing the viewer ends the playback.

    def __init__(self, viewer: Any, count: int, show: Callable[[int], None], fps: float) -> None:
        self._count, self._show, self._period_s = count, show, 1 / fps
        self.index, self._playing = -1, False
        gui = viewer._server.viser.gui
        self._slider = gui.add_slider("frame", 0, max(count - 1, 1), 1, 0, disabled=count < 2)
        self._button = gui.add_checkbox("play", False, disabled=count < 2)

        async def moved(event: Any) -> None:
            if event.client is not None:  # by a user, not by playing
                self.go_to(int(self._slider.value))

        async def pressed(_: Any) -> None:
            self.play(bool(self._button.value))

        self._slider.on_update(moved)
        self._button.on_update(pressed)
        self._drawer: Drawer[int] = Drawer(self._load, lambda: True, MAX_HZ)
        viewer._at_close.append(self.close)
        self.go_to(0)

    def go_to(self, i: int) -> None:
        """Show frame `i`."""
        self._drawer.offer(min(max(i, 0), self._count - 1))

    def play(self, on: bool) -> None:
        self._playing = on and self._count > 1
        if self._playing:
            self.go_to((self.index + 1) % self._count)

    def close(self) -> None:
        self._drawer.close()

    def _load(self, i: int) -> None:
        end = time.monotonic() + self._period_s
        try:
            self._show(i)
        finally:  # one frame that cannot be read does not end the others
            self.index = i
            if self._playing:
                self._slider.value = i
                nothing_newer = not self._drawer.wait_for_newer(end - time.monotonic())
                if nothing_newer and self._playing:
                    self.go_to((i + 1) % self._count)
