# SPDX-License-Identifier: MIT
"""``sdftrack fit``: pose and size of a primitive from a recorded sequence, a depth image or a point cloud."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import sdftrack as st
from sdftrack._internal.files import write_json
from sdftrack.cli.common import Common, Unit, above_zero, parse_box
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress
from sdftrack.cli.sources import Frames, Layout, fitting, load_camera, parse_intrinsics

CLOUDS = (".ply", ".obj", ".stl", ".xyz", ".npy")
IMAGES = (".png", ".tif", ".tiff")
MILLIMETRE = 0.001
HOW = "give its intrinsics by --camera FILE or --intrinsics fx,fy,cx,cy"


@dataclass(frozen=True, kw_only=True)
class Fit(Frames, Layout, Common):
    """Fit a sphere, cylinder, cone, box, ellipsoid, superquadric or plane patch of unknown size.

    Without --mask or --box, the sequence's own mask or the largest object on the table is used. Several frames are
    fitted sequentially, and their sizes averaged by information.

    Writes into DIR result.json (pose, size, covariance, scores; null: infinite variance), fit.png, and primitive.ply in
    the pose of the last frame (metres, camera frame).
    """

    source: Path = argument(
        "Recorded sequence, point cloud in metres, or a depth image (16-bit PNG, .npy) with its camera.",
        "SEQ|CLOUD.ply|DEPTH.png",
    )
    kind: Literal["auto", "sphere", "cylinder", "cone", "box", "ellipsoid", "plane", "superquadric"] = option(
        "auto", "Kind of primitive; auto: the best solid but for superquadrics; plane: a rectangle."
    )
    mask: Path | None = option(None, "Mask of the object in the first depth image.", metavar="mask.png")
    box: str | None = option(
        None, "Alternatively, a box in pixels; may contain other objects.", metavar="x,y,w,h"
    )
    frame: int | None = option(None, "Use only this frame.", min=0)
    no_plane: bool = option(False, "There is no supporting plane.")
    unit: Unit | None = option(None, "Unit of the point cloud (default: m).")
    camera: Path | None = option(
        None, "Camera of a depth image: camera.json, .yaml, cam_K.txt.", metavar="FILE"
    )
    intrinsics: str | None = option(None, "Alternatively, its intrinsics, pixels.", metavar="fx,fy,cx,cy")
    depth_scale: float | None = option(
        None,
        "Metres per unit of a depth image (default: 0.001 of integers, 1 of floats).",
        metavar="M",
        check=above_zero("metres per unit"),
    )
    seed: int = option(0, "Random seed of the initial guesses.", min=0, max=2**32 - 1)

    @property
    def part(self) -> slice:
        return super().part if self.frame is None else slice(self.frame, self.frame + 1)

    def check(self) -> None:
        if self.mask is not None and self.box is not None:
            raise Usage("expected --mask or --box, got both", "--mask")
        if self.frame is not None and (self.start, self.stop) != (0, None):
            raise Usage("expected --frame or --start and --stop, got both", "--frame")
        if self.intrinsics is not None and self.camera is not None:
            raise Usage("expected one of --intrinsics and --camera, got both", "--intrinsics")

    def check_source(self, alone: bool, cloud: bool) -> None:
        """Usage error for options that do not go with a single depth image, a cloud or a sequence."""
        part = not (super().part == slice(0, None, 1) and self.frame is None)
        by_image = (self.camera, self.intrinsics, self.depth_scale) != (None,) * 3
        if not alone and by_image:
            raise Usage(
                "expected a depth image (16-bit PNG or TIFF, .npy) with --camera, --intrinsics and --depth-scale, "
                "got a cloud or a sequence"
            )
        if alone and (part or self.unit is not None):
            got = "--unit, --frame, --start, --stop or --step"
            raise Usage(f"expected --depth-scale with a single depth image, got {got}")
        if cloud and (part or self.mask is not None or self.box is not None):
            of_sequences = "--mask, --box, --frame, --start, --stop and --step"
            raise Usage(f"expected a sequence with {of_sequences}, got a cloud")
        if not alone and not cloud and self.unit is not None:
            raise Usage("expected no unit with a sequence, whose depth has its own", "--unit")

    def options(self) -> dict[str, Any]:
        return {"seed": self.seed, "threads": self.threads, **({"plane": None} if self.no_plane else {})}


def fit(job: Fit) -> None:
    source = job.source
    _ = job.folder  # there has to be one
    job.on_cpu()
    job.check()
    if not source.exists():
        raise FileNotFoundError(f"SEQ: no such file or folder: {source}")
    inputs = [("SEQ|CLOUD.ply", source), ("--mask", job.mask), ("--camera", job.camera)]
    job.refuse_out(("result.json", "fit.png", "primitive.ply"), inputs)
    window = None if job.box is None else parse_box(job.box)
    alone = _is_depth_image(source)
    cloud = not alone and source.is_file() and source.suffix.lower() in CLOUDS
    job.check_source(alone, cloud)
    found, about, picture = (
        _fit_cloud(job) if cloud else _fit_image(job, window) if alone else _fit_sequence(job, window)
    )
    _write(job, found, about)
    picture()
    if job.quiet:
        return
    print(f"{source}: {found!r}")
    if found.reason:
        print(f"  {found.reason}")
    for i, why in found.skipped.items():
        print(f"  frame {i} left out: {why}")
    if len(found.scores) > 1:
        print("  scores: " + ", ".join(f"{kind} {score:.2f}" for kind, score in found.scores.items()))
    print(f"  written to {job.folder}")


Fitted = tuple[Any, dict[str, Any], Callable[[], object]]  # the result, what it is of, what makes fit.png


def _fit_cloud(job: Fit) -> Fitted:
    from sdftrack.io.clouds import read_cloud
    from sdftrack.mesh.files import unit_scale
    from sdftrack.viz.plots import write_plots
    from sdftrack.viz.primitives import plot_cloud

    points = read_cloud(job.source)
    options = {k: v for k, v in job.options().items() if k != "plane"}
    if job.unit is not None:
        options["unit"] = job.unit
    found = st.fit_primitive(points, job.kind, **options)
    metres = points * unit_scale(job.unit)
    about = {"cloud": str(job.source), "kind": job.kind, "points": len(points), **options}
    return found, about, lambda: write_plots(job.folder, {"fit.png": lambda: plot_cloud(metres, found)})


def _fit_image(job: Fit, window: tuple[float, ...] | None) -> Fitted:
    frame = _depth_image(job)
    found = st.fit_primitive(frame, job.kind, mask=_mask(job, window, frame, []), **job.options())
    about = {"depth": str(job.source), "kind": job.kind, **job.options()}
    return found, about, lambda: _draw(job, frame, found, frame.camera)


def _fit_sequence(job: Fit, window: tuple[float, ...] | None) -> Fitted:
    source = job.source
    with st.open_sequence(source, **job.opening) as seq:
        numbers, camera = job.numbers(seq, source, "--frame, --start, --stop"), seq.camera
        last = first = fitting(seq[numbers[0]], camera)
        mask = _mask(job, window, first, list(seq.masks(numbers[0]).values()))
        given: Any = first
        if len(numbers) > 1:
            counted = progress(numbers, len(numbers), source.name or str(source), job.quiet)
            given = (first if i == numbers[0] else fitting(seq[i], camera) for i in counted)
        found = st.fit_primitive(given, job.kind, camera=camera, mask=mask, **job.options())
        if len(numbers) > 1:
            found = replace(found, skipped={numbers[i]: why for i, why in found.skipped.items()})
            used = [i for i in numbers if i not in found.skipped] or [numbers[0]]
            last = fitting(seq[used[-1]], camera)
    about = {"sequence": str(source), "kind": job.kind, "frames": list(numbers), **job.options()}
    return found, about, lambda: _draw(job, last, found, camera)


def _draw(job: Fit, frame: Any, found: Any, camera: Any) -> None:
    from sdftrack.io.frames import write_color
    from sdftrack.viz.primitives import draw_primitives

    write_color(job.folder / "fit.png", draw_primitives(frame, [found], camera))


def _mask(job: Fit, window: tuple[float, ...] | None, frame: Any, own: list[Any]) -> Any:
    import numpy as np

    from sdftrack.io.frames import read_mask

    if job.mask is not None:
        return read_mask(job.mask, f"--mask {job.mask}")
    if window is None:
        known = [m for m in own if m.any()]
        return known[0] if len(known) == 1 else None
    x, y, w, h = (round(v) for v in window)
    mask = np.zeros(frame.shape, bool)
    mask[max(0, y) : max(0, y + h), max(0, x) : max(0, x + w)] = True
    if not mask.any():
        raise Usage(f"expected a box in the {frame.shape[1]} x {frame.shape[0]} depth image", "--box")
    return mask


def _is_depth_image(source: Path) -> bool:
    if not source.is_file():
        return False
    if source.suffix.lower() != ".npy":
        return source.suffix.lower() in IMAGES
    shape = _array(source).shape
    return len(shape) > 1 and shape[1:] != (3,)


def _array(source: Path) -> Any:
    from sdftrack._internal.saved_file import read_array

    with source.open("rb") as opened:
        try:
            return read_array(opened, source.stat().st_size)
        except ValueError as error:
            told = " ".join(str(error).split())
            raise ValueError(f"{source}: not a readable .npy file ({told})") from None


def _depth_image(job: Fit) -> Any:
    from sdftrack.camera.files import warn_if_doubtful
    from sdftrack.io.frames import read_depth_units

    source = job.source
    values = None if job.intrinsics is None else parse_intrinsics(job.intrinsics, "--intrinsics")
    if job.camera is None and values is None:
        raise Usage(f"expected the camera of a single depth image, got none: {HOW}", "--camera")
    depth: Any = _array(source) if source.suffix.lower() == ".npy" else read_depth_units(source)
    if depth.ndim != 2 or depth.dtype.kind not in "uif" or not depth.size:
        got = f"{depth.dtype} {depth.shape}"
        raise ValueError(f"{source}: expected depth (H, W) or points (N, 3) of numbers, got {got}")
    if values is not None:
        camera = st.Camera(*values, *depth.shape[::-1])
        warn_if_doubtful(camera, "--intrinsics")
    else:
        assert job.camera is not None
        camera = load_camera(job.camera, depth.shape, "the depth image")
    unit = 1.0 if depth.dtype.kind == "f" else MILLIMETRE
    return st.Frame(depth.astype("float32") * (job.depth_scale or unit), camera=camera)


def _write(job: Fit, found: Any, about: dict[str, Any]) -> None:
    out = job.make_out()
    mesh, T = found.to_mesh(), found.T_cam_obj
    st.Mesh(mesh.vertices @ T[:3, :3].T + T[:3, 3], mesh.faces).save(out / "primitive.ply")
    settings = {k: v for k, v in about.items() if k != "threads"}
    values = {"version": st.__version__, "settings": settings, **found.to_dict()}
    write_json(out / "result.json", {**values, "per_frame": [f.to_dict() for f in found.per_frame]})
