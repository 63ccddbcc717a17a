# SPDX-License-Identifier: MIT
"""Validation and conversion of images, masks and depth; calls written for scikit-image; the call of the core."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.extras import need
from sdftrack._internal.validation import positive
from sdftrack.device import host_array

MAX_PIXELS = 2**31 - 65
MAX_DEPTH = 200.0  # units of colour: the squared distance must fit into 31 bits


def checked_image(image: ArrayLike) -> NDArray[Any]:
    """(H, W) or (H, W, 3), C-contiguous, uint8, or float32 in 0..1."""
    return checked_values(checked_shape(image), None)


def checked_shape(image: ArrayLike) -> NDArray[Any]:
    """(H, W) or (H, W, 3), uint8 or float; values are not checked."""
    given = host_array(image, "image")
    if given.dtype.kind == "b" or (given.dtype.kind in "iu" and given.dtype != np.uint8):
        raise TypeError(
            f"image: expected uint8, or float in 0..1, got {given.dtype}; for uint8 images of another dtype use "
            "image.astype(np.uint8), for others divide by their largest value"
        )
    if given.dtype.kind not in "uf":
        raise TypeError(f"image: expected an array of uint8, or of float in 0..1, got {given.dtype}")
    if given.ndim == 3 and given.shape[2] == 1:
        given = given[..., 0]
    if given.ndim not in (2, 3) or (given.ndim == 3 and given.shape[2] != 3):
        hint = "; drop the alpha channel with image[..., :3]" if given.shape[2:] == (4,) else ""
        raise ValueError(f"image: expected (H, W, 3) or (H, W), got {given.shape}{hint}")
    if given.size == 0:
        raise ValueError(f"image: expected at least one pixel, got {given.shape}")
    if given.shape[0] * given.shape[1] > MAX_PIXELS:
        raise ValueError(
            f"image: expected fewer than 2^31 pixels, got {given.shape[0]} x {given.shape[1]}; cut it into parts"
        )
    return given


def checked_values(given: NDArray[Any], inside: NDArray[np.uint8] | None) -> NDArray[Any]:
    """C-contiguous, uint8, or float32 in 0..1; 0 outside a mask, where floats may be arbitrary."""
    if given.dtype == np.uint8:
        return np.ascontiguousarray(given)
    if inside is not None:
        within = inside.astype(bool)
        given = np.where(within if given.ndim == 2 else within[..., None], given, given.dtype.type(0))
    low, high = float(given.min()), float(given.max())
    if not (np.isfinite(low) and np.isfinite(high)):
        raise ValueError(
            "image: expected finite values in 0..1, got NaN or infinity; replace them or give a mask"
        )
    if low < 0 or high > 1:
        raise ValueError(
            f"image: expected floats in 0..1, got {low!r}..{high!r}; divide by the largest value, or give uint8"
        )
    return np.ascontiguousarray(given, dtype=np.float32)


def checked_mask(
    mask: ArrayLike | None, shape: tuple[int, ...], start_label: Any
) -> NDArray[np.uint8] | None:
    """Mask with 0 or 1 for each pixel, or None."""
    if mask is None:
        return None
    given = host_array(mask, "mask")
    if given.dtype.kind not in "biuf":
        raise TypeError(f"mask: expected an array of bool or numbers, got {given.dtype}")
    if given.shape != shape:
        raise ValueError(f"mask: expected the image's shape {shape}, got {given.shape}")
    if given.dtype.kind == "f" and np.isnan(given).any():
        raise ValueError("mask: expected numbers, 0 outside, got NaN; give numpy.isfinite of it")
    inside = np.ascontiguousarray(given != 0)
    if not inside.any():
        raise ValueError("mask: expected at least one pixel inside, got none")
    if start_label == 0:
        raise ValueError("start_label: expected at least 1 with a mask, got 0, which is the label outside it")
    return inside.view(np.uint8)


def part_with(inside: NDArray[np.uint8] | None, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Rows and columns of the bounding rectangle of the mask; the whole image without a mask."""
    if inside is None:
        return slice(0, shape[0]), slice(0, shape[1])
    rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def checked_depth(depth: ArrayLike | None, shape: tuple[int, ...], weight: Any) -> NDArray[np.float32] | None:
    """Depth in metres as float32, 0 where missing, or None."""
    per_m = positive(weight, "depth_weight")
    if depth is None:
        return None
    given = host_array(depth, "depth")
    if given.dtype.kind != "f":
        raise TypeError(
            f"depth: expected metres as float, got {given.dtype}; multiply by the unit, as 0.001 for mm"
        )
    if given.shape != shape:
        raise ValueError(f"depth: expected the image's shape {shape}, got {given.shape}")
    seen = np.ascontiguousarray(np.nan_to_num(given, nan=0.0, posinf=0.0, neginf=0.0), dtype=np.float32)
    if not per_m * float(seen.max()) <= MAX_DEPTH:
        raise ValueError(
            f"depth_weight: expected a number that times the largest depth, {float(seen.max()):g} m, is at most "
            f"{MAX_DEPTH:g}, got {per_m:g}"
        )
    return seen


# -- One image through the core: cut to its mask, and put back


BYTES_PER_PIXEL, BYTES_PER_SEGMENT = 10, 220


def core_labels(
    pixels: NDArray[Any],
    inside: NDArray[np.uint8] | None,
    seen: NDArray[np.float32] | None,
    options: Any,
    workers: int,
    number: int,
) -> NDArray[np.int32]:
    """Labels of an image, a mask and a depth image that have been checked, as `slic` returns them."""
    shape = pixels.shape[:2]
    part = part_with(inside, shape)
    pixels = np.ascontiguousarray(pixels[part])
    inside = None if inside is None else np.ascontiguousarray(inside[part])
    seen = None if seen is None else np.ascontiguousarray(seen[part])
    try:
        made: NDArray[np.int32] = _core.slic(pixels, options, inside, seen, workers, number)[0]
        if made.shape == shape:
            return made
        labels = np.zeros(shape, np.int32)
        labels[part] = made
        return labels
    except MemoryError:
        segments = min(options.n_segments, pixels.size)
        need = BYTES_PER_PIXEL * pixels.shape[0] * pixels.shape[1] + BYTES_PER_SEGMENT * segments
        raise MemoryError(
            f"image: {shape[0]} x {shape[1]} pixels in {segments} segments need about {need / 2**20:.0f} MiB of "
            "memory, which is not available; split the image"
        ) from None


NAMES = ("channel_axis", "sigma", "spacing", "convert2lab", "slic_zero", "max_size_factor")
OURS: Any = object()  # channel_axis where none is given: (H, W) is grey, else the last axis
WIDEST = 4.0  # of a blur, in sides of the image, beyond which it is even and only needs memory


@dataclass(frozen=True)
class Given:
    """The arguments of scikit-image beyond ours."""

    channel_axis: Any = OURS
    sigma: Any = 0
    spacing: Any = None
    convert2lab: bool | None = None
    slic_zero: bool = False
    max_size_factor: float = 3

    @property
    def blurs(self) -> bool:
        return self.sigma is not None and bool(np.any(np.asarray(self.sigma) != 0))


def taken(others: dict[str, Any]) -> Given:
    """TypeError for an unknown argument."""
    for name in others:
        if name not in NAMES:
            raise TypeError(f"slic() got an unexpected keyword argument {name!r}")
    return Given(**others)


def given_image(image: ArrayLike, given: Given) -> tuple[NDArray[Any], bool]:
    """The image with its channels last, and whether it has any."""
    pixels = host_array(image, "image")
    axis = given.channel_axis
    if axis is None or axis is OURS:
        return pixels, axis is OURS and pixels.ndim > 2
    if isinstance(axis, bool) or not isinstance(axis, (int, np.integer)):
        raise TypeError(f"channel_axis: expected a whole number or None, got {axis!r}")
    if pixels.ndim == 2:
        raise ValueError(
            f"channel_axis={axis} indicates multichannel, but the image has two axes; use channel_axis=None for grey"
        )
    if not -pixels.ndim <= axis < pixels.ndim:
        raise ValueError(f"channel_axis: expected an axis of an image of {pixels.shape}, got {axis}")
    return np.moveaxis(pixels, axis, -1), True


def is_theirs(pixels: NDArray[Any], colored: bool, given: Given) -> bool:
    """Whether only scikit-image does it. (H, W, 4) without a channel axis is a picture with alpha, which is refused."""
    ours = (1, 3, 4) if given.channel_axis is OURS else (1, 3)
    if pixels.ndim - colored > 2 or (colored and pixels.shape[-1] not in ours):
        return True
    if given.channel_axis is None or given.convert2lab is False or given.slic_zero or given.blurs:
        return True
    in_unit = pixels.dtype.kind == "f" and pixels.size > 0 and pixels.min() >= 0 and pixels.max() <= 1
    return given.spacing is not None or not (
        given.channel_axis is OURS or pixels.dtype == np.uint8 or in_unit
    )


def as_theirs(
    pixels: NDArray[Any], colored: bool, given: Given, inside: NDArray[np.uint8] | None, options: Any
) -> NDArray[np.int32]:
    """Labels by scikit-image (extra ``superpixels``), with our options."""
    theirs = need("skimage.segmentation", "superpixels").slic
    if pixels.dtype.kind not in "biuf":
        raise TypeError(f"image: expected an array of numbers, got {pixels.dtype}")
    if pixels.size == 0:
        raise ValueError(f"image: expected at least one pixel, got {pixels.shape}")
    channels = pixels.shape[-1] if colored else 1
    if given.convert2lab and channels != 3:
        raise ValueError(f"convert2lab: expected an image of three channels, got {channels}")
    values = pixels.astype(np.float64)
    within = None if inside is None else inside.view(np.bool_)
    if not np.isfinite(values if within is None else values[within]).all():
        raise ValueError(
            "image: expected finite values, got NaN or infinity; replace them or mask them out with mask"
        )
    if not options.compactness > 0:
        raise ValueError(f"compactness: expected a number above 0, got {options.compactness:g}; 10 is usual")
    sides = values.shape[:-1] if colored else values.shape
    sigma = 0 if given.sigma is None else _checked(given.sigma, "sigma", 0)
    widest = WIDEST * (np.array(sides) if np.shape(sigma) == (len(sides),) else max(sides))
    spacing = None if given.spacing is None else _checked(given.spacing, "spacing", np.nextafter(0, 1))
    return np.asarray(
        theirs(
            np.nan_to_num(values), options.n_segments, options.compactness, options.max_iterations,
            sigma=np.minimum(sigma, widest) if np.ndim(sigma) else float(min(sigma, widest)), spacing=spacing,
            convert2lab=given.convert2lab, enforce_connectivity=options.connected, min_size_factor=options.min_size,
            max_size_factor=given.max_size_factor, slic_zero=bool(given.slic_zero), start_label=options.first_label,
            mask=within, channel_axis=-1 if colored else None,
        ),
        np.int32,
    )  # fmt: skip


def _checked(value: Any, name: str, least: float) -> Any:
    """A number or an array of numbers of at least this much."""
    try:
        out = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected a number for each axis, got {value!r}") from None
    if not (np.isfinite(out).all() and (out >= least).all()):
        raise ValueError(f"{name}: expected finite numbers of at least {least:.0f}, got {value!r}")
    return out if out.ndim else float(out)
