# SPDX-License-Identifier: MIT
"""A page in the browser that shows a tracker while it runs."""

from __future__ import annotations

import atexit
import html
import threading
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.closing import ClosedByWith
from sdftrack.camera import depth_camera
from sdftrack.mesh import Mesh
from sdftrack.viz.viewer.drawer import Drawer
from sdftrack.viz.viewer.drawing import History, MeshShape, Shown
from sdftrack.viz.viewer.panel import Box, Click, Panel, Request
from sdftrack.viz.viewer.scene import Scene
from sdftrack.viz.viewer.server import PageServer


class Viewer(ClosedByWith):
    """A page that shows frames, poses and their reliability, and takes clicks (extra ``viewer``).

    A thread draws the newest frame while a page is open, and nothing otherwise; the tracker never waits for it.
    Everything is in the depth camera's frame.

    Parameters
    ----------
    shapes : SDF, Mesh, or list of them
        In the order of ``result.poses``. A Mesh is enough to look at results.
    camera : Camera or RGBDCamera
        A frame's own ``frame.camera`` takes precedence.
    names : list of str, optional
        One per object.
    meshes : list of Mesh or None, optional
        Shown in 3-D instead of the shapes, with their colours if they have some. m, object frame.
    host : str
        Address to listen at. Others than "localhost" can be reached from the network, and need the token.
    port : int
        The first port tried; 0: any.
    token : str, optional
        Part of the address of the page, without which it is refused. Default: a random one where needed.
    max_hz : float
        Drawn frames per second, at most.

    Attributes
    ----------
    url : str
        Address of the page.
    note : str
        "" or a sentence, e.g. that another port is used than asked for.

    Raises
    ------
    ImportError
        viser is not installed.
    OSError
        `host` is no address of this computer, or no port is free.
    ValueError
        The number of names or meshes differs from that of the shapes.

    Examples
    --------
    >>> with Viewer(sdf, live.camera) as viewer:  # doctest: +SKIP
    ...     print(viewer.url)
    ...     for frame in live:
    ...         viewer.show(frame, tracker.track(frame))
    """

    def __init__(
        self,
        shapes: Any,
        camera: Any,
        names: Sequence[str] | None = None,
        meshes: Sequence[Mesh | None] | None = None,
        *,
        host: str = "localhost",
        port: int = 8080,
        token: str | None = None,
        max_hz: float = 12.0,
    ) -> None:
        depth_camera(camera)
        if not max_hz > 0:
            raise ValueError(f"max_hz: expected frames per second above 0, got {max_hz!r}")
        self._shapes = [_drawable(s) for s in (shapes if isinstance(shapes, (list, tuple)) else [shapes])]
        for label, given in (("names", names), ("meshes", meshes)):
            if given is not None and len(given) != len(self._shapes):
                raise ValueError(f"{label}: expected {len(self._shapes)}, one per shape, got {len(given)}")
        self._camera = camera
        self._names = [f"object {k}" for k in range(len(self._shapes))] if names is None else list(names)
        self._meshes = {k: mesh for k, mesh in enumerate(meshes or ()) if mesh is not None}
        self._lock = threading.Lock()  # of the meshes
        self._requests: deque[Request] = deque()
        self._history = History()
        self._at_close: list[Callable[[], None]] = []
        self._picture: NDArray[np.uint8] | None = None
        self._closed = threading.Event()
        self._server = PageServer(host, port, token)
        self.url, self.note = self._server.url, self._server.note
        self._panel = Panel(
            self._server.viser, self._names, self._requests.append, lambda: self._drawer.again(), self._server.note,
        )  # fmt: skip
        self._scene = Scene(self._server.viser, partial(self._pointed, Click), partial(self._pointed, Box))
        self._drawer: Drawer[Shown] = Drawer(self._draw, lambda: self._server.pages() > 0, max_hz)
        self._server.viser.on_client_connect(lambda client: self._drawer.again())
        atexit.register(self.close)

    def show(
        self,
        frame: Any,
        result: Any,
        *,
        latency_s: float | None = None,
        dropped: int | None = None,
        shapes: Any = None,
        mask: NDArray[np.bool_] | None = None,
        notes: Sequence[str] = (),
    ) -> None:
        """Hand over a frame with its result, and return at once.

        Parameters
        ----------
        frame : Frame
            Its arrays must not be changed afterwards.
        result : TrackResult or None
            None: the frame alone.
        latency_s : float, optional
            Age of the frame, s; ``live.age_s(frame)``.
        dropped : int, optional
            Number of frames that the program never saw; ``live.dropped``.
        shapes : SDF, Mesh, or list of them, optional
            The shapes in this frame, if they change; drawn as outlines. The 3-D model of a growing shape is given to
            :meth:`set_mesh` whenever there is a new one.
        mask : (H, W) bool, optional
            Pixels of the only object, of the shown image's size: their outline is drawn instead of a shape.
        notes : list of str
            Lines above the statuses.

        Raises
        ------
        ValueError
            More poses than shapes.
        """
        now = list(self._shapes)
        if shapes is not None:
            given = shapes if isinstance(shapes, (list, tuple)) else [shapes]
            now[: len(given)] = [_drawable(s) for s in given]
        count = 0 if result is None else len(result.poses)
        if count > len(now):
            raise ValueError(f"result: expected at most {len(now)} objects, as many as shapes, got {count}")
        self._history.add(result)
        self._drawer.offer(
            Shown(frame, result, now[:count], self._names[:count], latency_s, dropped, mask, list(notes))
        )

    def requests(self) -> list[Request]:
        """What the user did since the last call, in order: `Click`, `Box`, `Pause`, `Record`, `Save`."""
        out = []
        while self._requests:
            out.append(self._requests.popleft())
        return out

    def tell(self, text: str) -> None:
        """Show a sentence above the statuses, e.g. what the user should do; "" removes it.

        It appears with the next frame.
        """
        self._panel.message = text

    def set_mesh(self, k: int, mesh: Mesh) -> None:
        """Show another 3-D model of object `k`: a reconstruction that has grown. Appears with the next frame."""
        with self._lock:
            if not 0 <= k < len(self._shapes):
                raise ValueError(f"k: expected 0..{len(self._shapes) - 1}, got {k}")
            self._meshes = {**self._meshes, k: mesh}

    @property
    def pages(self) -> int:
        """Number of open pages."""
        return self._server.pages()

    @property
    def picture(self) -> NDArray[np.uint8] | None:
        """(H, W, 3) uint8 RGB: the overlay drawn last; None before a page was open."""
        return self._picture

    def wait(self, seconds: float | None = None) -> None:
        """Wait until the viewer is closed, at most `seconds`. Ctrl-C raises KeyboardInterrupt, as always."""
        self._closed.wait(seconds)

    def close(self) -> None:
        """End the page and all threads; a second call does nothing."""
        if self._closed.is_set():
            return
        self._closed.set()
        atexit.unregister(self.close)
        for work in self._at_close:
            work()
        self._drawer.close()
        self._server.close()

    def __repr__(self) -> str:
        return f"Viewer({self.url!r}, {self.pages} pages open)"

    def _repr_html_(self) -> str:
        url = html.escape(self.url, quote=True)
        return f'<iframe src="{url}" width="100%" height="600" style="border:0"></iframe>'

    def _draw(self, shown: Shown) -> None:
        camera = shown.frame.camera if shown.frame.camera is not None else self._camera
        with self._lock:
            meshes = self._meshes
        self._picture = self._scene.update(shown, camera, meshes, self._history, self._panel.magnified)
        self._panel.update(shown, self._history)

    def _pointed(self, kind: type[Click | Box], *place: float) -> None:
        if self._panel.chosen >= 0:
            self._requests.append(kind(self._panel.chosen, *place))


def _drawable(shape: Any) -> Any:
    return MeshShape(shape) if isinstance(shape, Mesh) else shape
