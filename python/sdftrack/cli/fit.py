# SPDX-License-Identifier: MIT
"""``sdftrack fit``: pose and size of a primitive from a recorded sequence, a depth image or a point cloud."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ColorTopicOption,
    ConfigOption,
    DepthTopicOption,
    DeviceOption,
    LayoutOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    StartOption,
    StepOption,
    StopOption,
    ThreadsOption,
    Usage,
    check_cpu_only,
    opening,
    parse_box,
)
from sdftrack.cli.fit_image import is_depth_image, parse_intrinsics, read_depth_image
from sdftrack.cli.progress import progress

CLOUDS = (".ply", ".obj", ".stl", ".xyz", ".npy")


class Kind(str, Enum):
    auto = "auto"
    sphere = "sphere"
    cylinder = "cylinder"
    cone = "cone"
    box = "box"
    ellipsoid = "ellipsoid"
    plane = "plane"


class Unit(str, Enum):
    m = "m"
    mm = "mm"
    cm = "cm"
    inch = "in"


def fit(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SEQ|CLOUD.ply|DEPTH.png",
            help="Recorded sequence, point cloud in metres, or a depth image (16-bit PNG, .npy) with its camera.",
        ),
    ],
    kind: Annotated[
        Kind,
        typer.Option(
            help="Kind of primitive; auto: the best solid; plane: a rectangle.", case_sensitive=False
        ),
    ] = Kind.auto,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    mask: Annotated[
        Path | None, typer.Option(metavar="mask.png", help="Mask of the object in the first depth image.")
    ] = None,
    box: Annotated[
        str | None,
        typer.Option(metavar="x,y,w,h", help="Alternatively, a box in pixels; may contain other objects."),
    ] = None,
    frame: Annotated[int | None, typer.Option(min=0, help="Use only this frame.")] = None,
    start: StartOption = 0,
    stop: StopOption = None,
    step: StepOption = 1,
    no_plane: Annotated[bool, typer.Option("--no-plane", help="There is no supporting plane.")] = False,
    unit: Annotated[
        Unit | None, typer.Option(help="Unit of the point cloud (default: m).", case_sensitive=False)
    ] = None,
    camera: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Camera of a depth image: camera.json, .yaml, cam_K.txt."),
    ] = None,
    intrinsics: Annotated[
        str | None, typer.Option(metavar="fx,fy,cx,cy", help="Alternatively, its intrinsics, pixels.")
    ] = None,
    depth_scale: Annotated[
        float | None,
        typer.Option(
            metavar="M", help="Metres per unit of a depth image (default: 0.001 of integers, 1 of floats)."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1, help="Random seed of the initial guesses.")] = 0,
    layout: LayoutOption = "auto",
    depth_topic: DepthTopicOption = None,
    color_topic: ColorTopicOption = None,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Fit a sphere, cylinder, cone, box, ellipsoid or plane patch of unknown size.

    Without --mask or --box, the sequence's own mask or the largest object on the table is used. Several frames are
    fitted sequentially, and their sizes averaged by information.

    Writes into DIR result.json (pose, size, covariance, scores; null: infinite variance), fit.png, and primitive.ply in
    the pose of the last frame (metres, camera frame).
    """
    if out is None:
        raise Usage("expected a folder for the results: --out DIR", "--out")
    from sdftrack.io.out_folder import refuse_inputs

    arguments = opening(layout, depth_topic, color_topic)
    check_cpu_only(config, device)
    if mask is not None and box is not None:
        raise Usage("expected --mask or --box, got both", "--mask")
    if frame is not None and (start, stop) != (0, None):
        raise Usage("expected --frame or --start and --stop, got both", "--frame")
    if not source.exists():
        raise FileNotFoundError(f"SEQ: no such file or folder: {source}")
    refuse_inputs(
        out,
        ("result.json", "fit.png", "primitive.ply"),
        [("SEQ|CLOUD.ply", source), ("--mask", mask), ("--camera", camera)],
    )
    values = parse_intrinsics(intrinsics, camera)
    if depth_scale is not None and not 0 < depth_scale < math.inf:
        raise Usage(f"expected metres per unit, above 0, got {depth_scale:g}", "--depth-scale")
    alone = is_depth_image(source)
    if not alone and (camera is not None or values is not None or depth_scale is not None):
        raise Usage(
            "expected a depth image (16-bit PNG or TIFF, .npy) with --camera, --intrinsics and --depth-scale, "
            "got a cloud or a sequence"
        )
    window = None if box is None else parse_box(box)
    options: dict[str, Any] = {"seed": seed, "threads": threads}
    if no_plane:
        options["plane"] = None
    part = slice(frame, frame + 1) if frame is not None else slice(start, stop, step)
    if alone:
        if unit is not None or part != slice(0, None, 1):
            raise Usage(
                "expected --depth-scale with a single depth image, got --unit, --frame, --start, --stop or --step"
            )
        image = read_depth_image(source, camera, values, depth_scale)
        _fit_image(source, image, kind.value, out, overwrite, (mask, window), options, quiet)
    elif source.is_file() and source.suffix.lower() in CLOUDS:
        if mask is not None or box is not None or part != slice(0, None, 1):
            raise Usage(
                "expected a sequence with --mask, --box, --frame, --start, --stop and --step, got a cloud"
            )
        options.pop("plane", None)
        if unit is not None:
            options["unit"] = unit.value
        _fit_cloud(source, kind.value, out, overwrite, options, quiet)
    else:
        if unit is not None:
            raise Usage("expected no unit with a sequence, whose depth has its own", "--unit")
        _fit_sequence(source, kind.value, out, overwrite, (mask, window), part, arguments, options, quiet)


def _fit_cloud(source: Path, kind: str, out: Path, overwrite: bool, options: Any, quiet: bool) -> None:
    import sdftrack as st
    from sdftrack.io.clouds import read_cloud
    from sdftrack.mesh.files import unit_scale
    from sdftrack.viz.primitives import plot_cloud

    points = read_cloud(source)
    found = st.fit_primitive(points, kind, **options)
    folder = _written(
        out, overwrite, found, {"cloud": str(source), "kind": kind, "points": len(points), **options}
    )
    plot_cloud(folder / "fit.png", points * unit_scale(options.get("unit")), found)
    _tell(source, found, out, quiet)


def _fit_image(
    source: Path,
    frame: Any,
    kind: str,
    out: Path,
    overwrite: bool,
    place: tuple[Path | None, tuple[float, ...] | None],
    options: dict[str, Any],
    quiet: bool,
) -> None:
    import sdftrack as st
    from sdftrack.viz.pictures import save_picture
    from sdftrack.viz.primitives import draw_primitives

    found = st.fit_primitive(frame, kind, mask=_mask(place, frame, []), **options)
    folder = _written(out, overwrite, found, {"depth": str(source), "kind": kind, **options})
    save_picture(folder / "fit.png", draw_primitives(frame, [found], frame.camera))
    _tell(source, found, out, quiet)


def _fit_sequence(
    source: Path,
    kind: str,
    out: Path,
    overwrite: bool,
    place: tuple[Path | None, tuple[float, ...] | None],
    part: slice,
    arguments: dict[str, Any],
    options: dict[str, Any],
    quiet: bool,
) -> None:
    import sdftrack as st
    from sdftrack.cli.track import fitting
    from sdftrack.viz.pictures import save_picture
    from sdftrack.viz.primitives import draw_primitives

    with st.open_sequence(source, **arguments) as seq:
        numbers = range(len(seq))[part]
        if not len(numbers):
            raise ValueError(
                f"--frame, --start, --stop: expected some of the {len(seq)} frames of {source}, got none"
            )
        first = fitting(seq[numbers[0]], seq.camera)
        mask = _mask(place, first, list(seq.masks(numbers[0]).values()))

        def frames() -> Any:
            for i in progress(numbers, len(numbers), source.name or str(source), quiet):
                yield first if i == numbers[0] else fitting(seq[i], seq.camera)

        if len(numbers) == 1:
            found = st.fit_primitive(first, kind, camera=seq.camera, mask=mask, **options)
            last = first
        else:
            found = st.fit_primitive(frames(), kind, camera=seq.camera, mask=mask, **options)
            found = replace(found, skipped={numbers[i]: why for i, why in found.skipped.items()})
            seen_in = [i for i in numbers if i not in found.skipped] or [numbers[0]]
            last = fitting(seq[seen_in[-1]], seq.camera)
        about = {"sequence": str(source), "kind": kind, "frames": list(numbers), **options}
        folder = _written(out, overwrite, found, about)
        save_picture(folder / "fit.png", draw_primitives(last, [found], seq.camera))
    _tell(source, found, out, quiet)


def _mask(place: tuple[Path | None, tuple[float, ...] | None], frame: Any, own: list[Any]) -> Any:
    """The mask that is asked for; else the only one of the sequence's `own`, or None."""
    import numpy as np

    from sdftrack.io.frames import read_mask

    path, box = place
    if path is not None:
        if not path.is_file():
            raise FileNotFoundError(f"--mask: no such file: {path}")
        return read_mask(path)
    if box is None:
        known = [m for m in own if m.any()]
        return known[0] if len(known) == 1 else None
    x, y, w, h = (round(v) for v in box)
    mask = np.zeros(frame.shape, bool)
    mask[max(0, y) : max(0, y + h), max(0, x) : max(0, x + w)] = True
    if not mask.any():
        raise Usage(f"expected a box in the {frame.shape[1]} x {frame.shape[0]} depth image", "--box")
    return mask


def _written(out: Path, overwrite: bool, found: Any, about: dict[str, Any]) -> Path:
    """Create the folder with result.json and primitive.ply."""
    import sdftrack as st
    from sdftrack._internal.files import write_json
    from sdftrack.recorder import prepare_folder

    prepare_folder(out, overwrite)
    mesh = found.to_mesh()
    T = found.T_cam_obj
    st.Mesh(mesh.vertices @ T[:3, :3].T + T[:3, 3], mesh.faces).save(out / "primitive.ply")
    per_frame = [f.to_dict() for f in found.per_frame]
    settings = {k: v for k, v in about.items() if k != "threads"}
    write_json(
        out / "result.json",
        {"version": st.__version__, "settings": settings, **found.to_dict(), "per_frame": per_frame},
    )
    return out


def _tell(source: Path, found: Any, out: Path, quiet: bool) -> None:
    if quiet:
        return
    print(f"{source}: {found!r}")
    if found.reason:
        print(f"  {found.reason}")
    for i, why in found.skipped.items():
        print(f"  frame {i} left out: {why}")
    if len(found.scores) > 1:
        print("  scores: " + ", ".join(f"{kind} {score:.2f}" for kind, score in found.scores.items()))
    print(f"  written to {out}")
