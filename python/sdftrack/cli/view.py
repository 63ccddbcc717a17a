# SPDX-License-Identifier: MIT
"""``sdftrack view``: results, a sequence or a mesh in the browser."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import sdftrack as st
from sdftrack._internal.closing import closed_on_error
from sdftrack.cli.common import Common, Unit
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.sources import Layout

MESHES = (".ply", ".obj", ".glb", ".stl")


def _seconds(value: float) -> float:
    if not 0 <= value < math.inf:
        raise Usage(f"expected seconds, 0 or more, got {value}")
    return value


@dataclass(frozen=True, kw_only=True)
class View(Layout, Common):
    """Show results, a sequence or a mesh on a page in the browser, until Ctrl-C.

    The page's save button writes the image that it shows into DIR of --out, as view_NNNNNN.png.
    """

    path: Path = argument(
        "Output folder of track or reconstruct, a recorded sequence, or a mesh.", "DIR|SEQ|MESH"
    )
    seq: str | None = option(None, "The sequence of the results, if it has been moved.", metavar="SEQ")
    host: str = option(
        "localhost", "Address to listen at; others than localhost are for the network, with a token."
    )
    port: int = option(8080, "First port tried; 0: any free one.", min=0, max=65535)
    seconds: float | None = option(
        None, "End after so many seconds. Default: at Ctrl-C.", metavar="S", check=_seconds
    )
    unit: Unit | None = option(None, "Unit of the meshes.")


def view(job: View) -> None:
    job.on_cpu()
    path = job.path
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such folder or file")
    mesh = path.is_file() and path.suffix.lower() in MESHES
    shown = load_mesh_alone(path, job.unit) if mesh else load_recording(path, job.seq, job.opening, job.unit)
    try:
        if job.out is not None:
            job.make_out()
        _serve(shown, job)
    except KeyboardInterrupt:
        pass  # the usual end
    finally:
        shown.close()


def _serve(shown: Any, job: View) -> None:
    import time

    from sdftrack.viz.view import view as open_view

    about = {"camera": shown.camera, "names": shown.names, "host": job.host, "port": job.port}
    with open_view(shown.frames, shown.results, shown.meshes, **about) as viewer:
        if viewer.note and not job.quiet:
            print(viewer.note)
        # Also with --quiet: without its address the page cannot be opened.
        print(f"the page: {viewer.url} (Ctrl-C ends)", flush=True)
        end = math.inf if job.seconds is None else time.monotonic() + job.seconds
        while (left := end - time.monotonic()) > 0:
            viewer.wait(min(left, 0.2))
            _save(viewer, job.out)


def _save(viewer: Any, out: Path | None) -> None:
    """Write the shown image for each `Save` that the page asked for."""
    from sdftrack.io.frames import write_color
    from sdftrack.viz.viewer import Save

    for request in viewer.requests():
        if not isinstance(request, Save) or viewer.picture is None:
            continue
        if out is None:
            print("not saved: start with --out DIR", flush=True)
            continue
        names = (out / f"view_{n:06d}.png" for n in itertools.count())
        path = next(name for name in names if not name.exists())
        write_color(path, viewer.picture)
        print(f"saved {path}", flush=True)


MAX_SIDE_M = 3.0  # a larger model was tracked in another unit than metres


@dataclass
class Recording:
    """Frames with results, None where a frame has none, and the meshes of the objects."""

    frames: Any
    camera: Any
    results: list[Any]
    meshes: list[Any] = field(default_factory=list)
    names: list[str] = field(default_factory=list)

    def close(self) -> None:
        getattr(self.frames, "close", lambda: None)()


def load_recording(path: Path, seq: str | None, arguments: dict[str, Any], unit: str | None) -> Recording:
    """A result folder of `track` or `reconstruct`, or a sequence without results. `arguments`: those of
    `open_sequence`."""
    if not (path / "report.json").is_file():
        sequence = st.open_sequence(path, **arguments)
        return Recording(sequence, sequence.camera, [None] * len(sequence))
    from sdftrack.io.report_file import read_results, result_of

    report = read_results(path)
    settings, rows = report["settings"], report["frames"]
    source = seq if seq is not None else settings.get("sequence")
    if source is None:
        raise ValueError(f"--seq: expected the sequence of {path}, which its report does not name, got none")
    if seq is None:
        arguments = {**arguments, "layout": settings.get("layout", "auto")}
    sequence = st.open_sequence(source, **arguments)
    with closed_on_error(sequence):
        number = {im_id: i for i, im_id in enumerate(sequence.ids)}
        missing = [row["im_id"] for row in rows if row["im_id"] not in number]
        if missing:
            expected = f"expected a sequence with the images of {path}"
            raise ValueError(f"--seq: {expected}, but {source} has no {missing[0]}")
        frames = sequence.part([number[row["im_id"]] for row in rows])
        objects: list[Any] = max((row["objects"] for row in rows), key=len, default=[])
        meshes = _meshes(path, settings, len(objects), sequence, unit)
        names, results = [str(o["name"]) for o in objects], [result_of(row) for row in rows]
        return Recording(frames, sequence.camera, results, meshes, names)


def model_of_report(path: Path, k: int) -> Any:
    from sdftrack.io.report_file import read_results

    settings = read_results(path)["settings"]
    if settings.get("command") == "reconstruct":
        return _meshes(path, settings, 1, _NO_MODELS, None)[0] if (path / "mesh.ply").is_file() else None
    models = settings.get("models", [])
    if k >= len(models) or not Path(models[k]).is_file():
        return None
    return _meshes(path, {**settings, "models": [models[k]]}, 1, _NO_MODELS, None)[0]


_NO_MODELS = SimpleNamespace(models={})  # in place of a sequence: it has none of its own


def _meshes(path: Path, settings: dict[str, Any], count: int, seq: Any, unit: str | None) -> list[Any]:
    from sdftrack.cli.objects import load_mesh, own_obj_id

    if settings.get("command") == "reconstruct":
        return [load_mesh(path / "mesh.ply", "DIR", "m")]
    models = [Path(m) for m in settings.get("models", [])]
    if len(models) != count:
        raise ValueError(f"{path}: expected a report that names its {count} models, got {len(models)}")
    loaded = {}
    for model in set(models):
        mesh = load_mesh(model, "models of the report", unit)
        own = own_obj_id(mesh, seq, known_unit=unit is not None)
        if own is not None:
            mesh = seq.models[own]
        elif unit is None and float((mesh.bounds[1] - mesh.bounds[0]).max()) > MAX_SIDE_M:
            mesh = load_mesh(model, "models of the report", "mm")  # the report does not tell the unit
        loaded[model] = mesh
    return [loaded[model] for model in models]


def load_mesh_alone(path: Path, unit: str | None) -> Recording:
    """A mesh before a camera that sees all of it; the image is its rendering."""
    import numpy as np

    from sdftrack.cli.objects import load_mesh
    from sdftrack.io.report_file import result_of

    mesh = load_mesh(path, "MESH", unit)
    low, high = mesh.bounds
    radius = 0.5 * float(np.linalg.norm(high - low))
    camera = st.Camera.from_fov(np.radians(40), 640, 480)
    # Seen from above and in front, y of the camera against z of the object: as most models stand.
    sin, cos = np.sin(np.radians(25)), np.cos(np.radians(25))
    T = np.eye(4)
    T[:3, :3] = [[1, 0, 0], [0, sin, -cos], [0, cos, sin]]
    T[:3, 3] = np.array([0, 0, 3.6 * radius]) - T[:3, :3] @ (0.5 * (low + high))
    depth, normals, colors = mesh.raycast(camera, T)
    lit = (255 * (0.25 + 0.7 * np.abs(normals[..., 2:]))).clip(0, 255) * np.ones(3)
    picture = lit if colors is None else lit / 255 * colors
    frame = st.Frame(depth, np.where(depth[..., None] > 0, picture, 24).astype(np.uint8), check_units=False)
    row = {"objects": [{"pose": T.tolist(), "status": "ok", "reason": "", "confidence": 1.0}]}
    return Recording([frame], camera, [result_of(row)], [mesh], [path.stem])
