# SPDX-License-Identifier: MIT
"""``sdftrack superpixels``: superpixel segmentation of an image."""

from __future__ import annotations

import time
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ConfigOption,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    ThreadsOption,
    Usage,
    check_common,
)

FILES = ("labels.png", "labels.npy", "boundaries.png", "mean.png", "result.json")


class Space(str, Enum):
    lab = "lab"
    xyz = "xyz"
    rgb = "rgb"


class Distance(str, Enum):
    slic = "slic"
    thesis = "thesis"


def superpixels(
    image: Annotated[Path, typer.Argument(metavar="IMAGE", help="PNG, JPEG or another image file.")],
    segments: Annotated[int, typer.Option(min=1, help="Approximate number of segments.")] = 1200,
    compactness: Annotated[float, typer.Option(help="Compactness m; larger: rounder segments.")] = 10.0,
    iterations: Annotated[int, typer.Option(min=1, help="Maximum number of k-means iterations.")] = 5,
    color_space: Annotated[
        Space, typer.Option(help="Colour space of the comparison.", case_sensitive=False)
    ] = Space.lab,
    distance: Annotated[
        Distance, typer.Option(help="slic: squared; thesis: d_lab + (m / S) d_xy.", case_sensitive=False)
    ] = Distance.slic,
    mask: Annotated[Path | None, typer.Option(metavar="mask.png", help="Segment only these pixels.")] = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Segment an image into superpixels (small regions of uniform colour).

    Writes into DIR labels.png (16 bit; labels.npy, 32 bit, where there are
    more than 65535), boundaries.png, mean.png and result.json.
    """
    if out is None:
        raise Usage("expected a folder for the results: --out DIR", "--out")
    if not 0 < compactness <= 4000:
        raise Usage(f"expected a number above 0 and up to 4000, got {compactness}", "--compactness")
    import sdftrack as st
    from sdftrack.io.frames import read_color, read_mask
    from sdftrack.io.out_folder import prepare_folder, refuse_folder, refuse_inputs

    check_common(config, device)
    picture = read_color(image, f"IMAGE {image}")
    inside = None if mask is None else read_mask(mask, f"--mask {mask}")
    refuse_folder(out, overwrite)
    refuse_inputs(out, FILES, [("IMAGE", image), ("--mask", mask)])
    options: dict[str, Any] = {
        "n_segments": segments, "compactness": compactness, "max_num_iter": iterations,
        "color_space": color_space.value, "distance": distance.value,
    }  # fmt: skip
    began = time.perf_counter()
    labels = st.superpixels.slic(picture, **options, mask=inside, threads=threads, device=device)
    seconds = time.perf_counter() - began
    prepare_folder(out, overwrite)
    _write(out, picture, labels, {"image": str(image), "mask": mask and str(mask), **options}, seconds)
    if not quiet:
        size = f"{picture.shape[1]} x {picture.shape[0]} pixels"
        print(f"{image}: {labels.max()} segments of {size} in {1e3 * seconds:.1f} ms")
        print(f"  written to {out}")


def _write(out: Path, picture: Any, labels: Any, settings: dict[str, Any], seconds: float) -> None:
    import numpy as np

    import sdftrack as st
    from sdftrack._internal.files import write_json
    from sdftrack.viz.pictures import save_picture

    segments = int(labels.max())
    files = _save_labels(out, labels, segments)
    save_picture(out / "boundaries.png", st.superpixels.mark_boundaries(picture, labels))
    save_picture(out / "mean.png", st.superpixels.mean_colors(picture, labels))
    areas = np.bincount(labels.ravel())[1:]
    write_json(
        out / "result.json",
        {
            "version": st.__version__,
            "settings": {"command": "superpixels", **settings, "files": files},
            "size": [picture.shape[1], picture.shape[0]],
            "segments": segments,
            "smallest_px": int(areas.min()),
            "largest_px": int(areas.max()),
            "neighbors": int(np.count_nonzero(st.superpixels.adjacency(labels)[:, 0] > 0)),
            "seconds": seconds,
        },
    )


def _save_labels(out: Path, labels: Any, segments: int) -> list[str]:
    """Write labels as 16-bit PNG, and as an array if they do not fit; returns the file names."""
    import cv2
    import numpy as np

    from sdftrack._internal.files import write_whole

    if segments > np.iinfo(np.uint16).max:
        write_whole(out / "labels.npy", lambda file: np.save(file, labels))
    else:
        _drop_old_array(out)
    shown = np.minimum(labels, np.iinfo(np.uint16).max).astype(np.uint16)
    write_whole(out / "labels.png", cv2.imencode(".png", shown)[1].tobytes())
    return ["labels.png", "labels.npy"] if segments > np.iinfo(np.uint16).max else ["labels.png"]


def _drop_old_array(out: Path) -> None:
    """Remove labels.npy if an earlier run's report lists it."""
    import contextlib
    import json

    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        old = json.loads((out / "result.json").read_text(encoding="utf-8"))["settings"]
        if old["command"] == "superpixels" and "labels.npy" in old["files"]:
            (out / "labels.npy").unlink(missing_ok=True)
