# SPDX-License-Identifier: MIT
"""Outlines with shape memory, regression, superpixels."""

from pathlib import Path

import cv2
import numpy as np
from digest import Hashes, digest

import sdftrack as st
from experiments.synth.gait import gait
from experiments.synth.gait_video import gait_video


def _outlines(images, memory=None, **start) -> tuple[str, str]:
    options = {"confidence": "colors", "motion": "none", "box_start": "colors", **start.pop("options", {})}
    tracker = st.contour.ContourTracker(memory=memory, burn_in=12, **options)
    results = [tracker.start(images[0], **start)] + [tracker.track(image) for image in images[1:]]
    said = [(str(r.status), r.judgement) for r in results]
    return digest([r.mask for r in results], [r.phi for r in results], [r.warp for r in results]), digest(
        said
    )


def contours() -> Hashes:
    """A walking figure that a bar passes: with and without memory, from a box and from a mask."""
    video = gait_video("cat", 26, during=(18, 23), size=(240, 180), seed=2)
    images, truth = video.images, video.seen[0]
    y, x = np.nonzero(truth)
    box = (int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1)
    out = {}
    for name, memory in (("plain", None), ("memory", st.contour.ShapeMemory(10, 3))):
        out[name], out[f"{name} status"] = _outlines(images, memory, mask=truth)
    out["box"], out["box status"] = _outlines(images[:8], None, box=box)
    out["affine"], _ = _outlines(images[:8], None, mask=truth, options={"warp": "affine"})
    out["harmonics"] = digest(st.contour.harmonics(truth, 12))
    return out


def memory() -> Hashes:
    """Shapes learned one after another, then a hidden one recovered."""
    shapes = gait("walker", 60)
    keeper = st.contour.ShapeMemory(10, 3)
    for mask in shapes[:50]:
        keeper.learn(mask)
    hidden = shapes[55].copy()
    hidden[:, : hidden.shape[1] // 3] = False
    return {"judged": digest([keeper.judge(s) for s in shapes[50:]], keeper.judge(hidden)),
            "recovered": digest(keeper.recover(hidden))}  # fmt: skip


def regression() -> Hashes:
    """The cross function, sample by sample, with intervals."""
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (1500, 2))
    y = np.maximum.reduce([np.exp(-10 * x[:, 0] ** 2), np.exp(-50 * x[:, 1] ** 2),
                           1.25 * np.exp(-5 * (x**2).sum(1))])[:, None]  # fmt: skip
    model = st.LWPR(2, 1, init_D=50.0)
    model.update(x, y + 0.1 * rng.normal(size=y.shape))
    mean, sd = model.predict(x[:200], return_std=True)
    return {"mean": digest(mean), "deviation": digest(sd), "fields": digest(model.n_fields)}


def superpixels() -> Hashes:
    """Both distances, all colour spaces, a mask, one segment per row of a noisy picture."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[:180, :240]
    waves = np.stack([np.sin(x / 17), np.cos(y / 13), np.sin((x + y) / 29)], -1)
    picture = np.clip(128 + 80 * waves + rng.normal(0, 8, waves.shape), 0, 255).astype(np.uint8)
    out = {}
    for distance in ("slic", "thesis"):
        for space in ("lab", "xyz", "rgb"):
            labels = st.superpixels.slic(picture, 150, color_space=space, distance=distance)
            out[f"{distance} {space}"] = digest(labels)
    inside = (x - 120) ** 2 + (y - 90) ** 2 < 80**2
    out["mask"] = digest(st.superpixels.slic(picture, 60, mask=inside))
    return {
        **out,
        "regions": digest(st.superpixels.mean_colors(picture, labels), st.superpixels.adjacency(labels)),
    }


def recorded_videos(data: Path) -> Hashes:
    """Animals and a dancer."""
    out = {}
    for name in ("camel", "dance-twirl"):
        folder = data / "davis" / name
        paths = sorted(p for p in folder.rglob("*.jpg"))[:20]
        masks = sorted(p for p in folder.rglob("*.png"))
        images = [cv2.imread(str(p))[..., ::-1] for p in paths]
        truth = cv2.imread(str(masks[0]), cv2.IMREAD_GRAYSCALE) > 0
        out[name], out[f"{name} status"] = _outlines(images, None, mask=truth)
    return out


def recorded_images(data: Path) -> Hashes:
    """Superpixels of photographs."""
    paths = sorted((data / "bsds" / "images").iterdir())[:3]
    return {p.stem: digest(st.superpixels.slic(cv2.imread(str(p))[..., ::-1], 400)) for p in paths}


SYNTHETIC = (contours, memory, regression, superpixels)
RECORDED = (recorded_videos, recorded_images)
