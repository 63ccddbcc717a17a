# SPDX-License-Identifier: MIT
"""``sdftrack superpixels``: superpixel segmentation of an image."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import sdftrack as st
from sdftrack._internal.files import write_json, write_whole
from sdftrack.cli.common import Common, above_zero
from sdftrack.cli.options import argument, option

FILES = ("labels.png", "labels.npy", "boundaries.png", "mean.png", "result.json")


@dataclass(frozen=True, kw_only=True)
class Superpixels(Common):
    """Segment an image into superpixels (small regions of uniform colour).

    Writes into DIR labels.png (16 bit; labels.npy, 32 bit, where there are
    more than 65535), boundaries.png, mean.png and result.json.
    """

    image: Path = argument("PNG, JPEG or another image file.", "IMAGE")
    segments: int = option(1200, "Approximate number of segments.", min=1)
    compactness: float = option(
        10.0, "Compactness m; larger: rounder segments.", check=above_zero("a number", 4000)
    )
    iterations: int = option(5, "Maximum number of k-means iterations.", min=1)
    color_space: Literal["lab", "xyz", "rgb"] = option("lab", "Colour space of the comparison.")
    distance: Literal["slic", "thesis"] = option("slic", "slic: squared; thesis: d_lab + (m / S) d_xy.")
    mask: Path | None = option(None, "Segment only these pixels.", metavar="mask.png")


def superpixels(job: Superpixels) -> None:
    out = job.folder
    import numpy as np

    from sdftrack.io.frames import read_color, read_mask, write_color, write_depth_units
    from sdftrack.io.out_folder import earlier_files

    job.on_device()
    picture = read_color(job.image, f"IMAGE {job.image}")
    inside = None if job.mask is None else read_mask(job.mask, f"--mask {job.mask}")
    job.refuse_out(FILES, [("IMAGE", job.image), ("--mask", job.mask)])
    options: dict[str, Any] = {
        "n_segments": job.segments, "compactness": job.compactness, "max_num_iter": job.iterations,
        "color_space": job.color_space, "distance": job.distance,
    }  # fmt: skip
    began = time.perf_counter()
    labels = st.superpixels.slic(picture, **options, mask=inside, threads=job.threads, device=job.device)
    seconds = time.perf_counter() - began
    job.make_out()
    # 16-bit PNG, and an array if the labels do not fit.
    most, files = np.iinfo(np.uint16).max, ["labels.png"]
    write_depth_units(out / "labels.png", np.minimum(labels, most).astype(np.uint16))
    if labels.max() > most:
        write_whole(out / "labels.npy", lambda file: np.save(file, labels))
        files.append("labels.npy")
    elif "labels.npy" in earlier_files(out, "result.json", "superpixels"):
        (out / "labels.npy").unlink(missing_ok=True)
    write_color(out / "boundaries.png", st.superpixels.mark_boundaries(picture, labels))
    write_color(out / "mean.png", st.superpixels.mean_colors(picture, labels))
    settings = {"image": str(job.image), "mask": job.mask and str(job.mask), **options, "files": files}
    areas = np.bincount(labels.ravel())[1:]
    result = {
        "version": st.__version__, "settings": {"command": "superpixels", **settings},
        "size": [picture.shape[1], picture.shape[0]], "segments": int(labels.max()),
        "smallest_px": int(areas.min()), "largest_px": int(areas.max()),
        "neighbors": int(np.count_nonzero(st.superpixels.adjacency(labels)[:, 0] > 0)), "seconds": seconds,
    }  # fmt: skip
    write_json(out / "result.json", result)
    if not job.quiet:
        size = f"{picture.shape[1]} x {picture.shape[0]} pixels"
        print(f"{job.image}: {labels.max()} segments of {size} in {1e3 * seconds:.1f} ms")
        print(f"  written to {out}")
