# SPDX-License-Identifier: MIT
"""Calls written for ``skimage.segmentation.slic``: its arguments beyond ours, its images, its scale of colours."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack.device import host_array
from sdftrack.superpixels.any_image import Clustering, segment
from sdftrack.superpixels.arguments import core_labels

NAMES = ("channel_axis", "sigma", "spacing", "convert2lab", "slic_zero", "max_size_factor")
MAX_COMPACT = 4000.0  # of the core: from here on colours have no say
OURS: Any = object()  # channel_axis where none is given: (H, W) is grey, else the last axis
Array = NDArray[np.float64]
RGB_TO_XYZ = np.array(
    [[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]]
)
WHITE_XYZ = np.array([0.95047, 1.0, 1.08883])  # D65, as seen by two degrees of the eye


@dataclass(frozen=True)
class Given:
    """The arguments of scikit-image, for an image of `axes` spatial axes."""

    channel_axis: Any = OURS
    sigma: Any = 0
    spacing: Any = None
    convert2lab: bool | None = None
    slic_zero: bool = False
    max_size_factor: float = 3


def taken(others: dict[str, Any]) -> Given:
    """TypeError for an unknown argument."""
    for name in others:
        if name not in NAMES:
            raise TypeError(f"slic() got an unexpected keyword argument {name!r}")
    return Given(**others)


def given_image(image: ArrayLike, given: Given) -> tuple[NDArray[Any], bool]:
    """The image with its channels last, and whether it has any; an axis of one channel is dropped."""
    pixels = host_array(image, "image")
    axis = given.channel_axis
    if axis is None:
        if pixels.ndim not in (2, 3):
            raise ValueError(
                f"image: expected (H, W) or (D, H, W) with channel_axis=None, got {pixels.shape}"
            )
        return pixels, False
    if axis is OURS:
        return pixels, pixels.ndim > 2
    if pixels.ndim == 2:
        raise ValueError(
            f"channel_axis={axis} indicates multichannel, but the image has two axes; use channel_axis=None for grey"
        )
    if isinstance(axis, bool) or not isinstance(axis, (int, np.integer)):
        raise TypeError(f"channel_axis: expected a whole number or None, got {axis!r}")
    if not -pixels.ndim <= axis < pixels.ndim:
        raise ValueError(f"channel_axis: expected an axis of an image of {pixels.shape}, got {axis}")
    if pixels.shape[axis] != 3 and given.convert2lab:
        raise ValueError(f"convert2lab: expected an image of three channels, got {pixels.shape[axis]}")
    return np.moveaxis(pixels, axis, -1), True


def is_theirs(pixels: NDArray[Any], colored: bool, given: Given) -> bool:
    """Whether the image and the arguments mean something only in scikit-image; the rest is ours, or refused."""
    if needs_numpy(pixels, colored, given) or given.convert2lab is False or given.channel_axis is None:
        return True
    if given.channel_axis is OURS:
        return _blurs(given)
    return _blurs(given) or not (pixels.dtype == np.uint8 or (pixels.dtype.kind == "f" and _in_unit(pixels)))


def needs_numpy(pixels: NDArray[Any], colored: bool, given: Given) -> bool:
    """Whether the core cannot do it. (H, W, 4) without a channel axis is a picture with alpha, which is refused."""
    usual = (1, 3, 4) if given.channel_axis is OURS else (1, 3)
    return (
        pixels.ndim - colored > 2
        or (colored and pixels.shape[-1] not in usual)
        or bool(given.slic_zero)
        or given.spacing is not None
    )


def as_theirs(
    pixels: NDArray[Any],
    colored: bool,
    given: Given,
    inside: NDArray[np.uint8] | None,
    options: Any,
    color_space: str,
    workers: int,
    number: int,
) -> NDArray[np.int32]:
    """Labels of a call that means something only in scikit-image."""
    within = None if inside is None else inside.view(np.bool_)
    if not options.compactness > 0:
        raise ValueError(f"compactness: expected a number above 0, got {options.compactness:g}; 10 is usual")
    axes = pixels.ndim - colored
    spacing_of(given, axes)
    values = rescaled(pixels, within, colored)
    to_lab = colored and pixels.shape[-1] == 3 and given.convert2lab is not False
    if not needs_numpy(pixels, colored, given):
        values = smooth(values, given, colored)
        if colored and values.shape[-1] == 1:
            values, colored = values[..., 0], False
        if not to_lab and color_space == "lab":  # grey is three equal channels, all of them in percent
            options.space = "rgb"
            options.compactness = min(100 * options.compactness * (1 if colored else 3**0.5), MAX_COMPACT)
        return core_labels(np.ascontiguousarray(values, np.float32), inside, None, options, workers, number)
    features = smooth(lab_of(values) if to_lab else values, given, colored)
    clustering = Clustering(
        options.n_segments, options.compactness, options.max_iterations, spacing_of(given, axes),
        bool(given.slic_zero), options.min_size, options.connected, options.first_label,
    )  # fmt: skip
    everywhere = np.ones(features.shape[:axes], bool) if within is None else within
    return segment(features if colored else features[..., None], everywhere, clustering)


def _blurs(given: Given) -> bool:
    return given.sigma is not None and bool(np.any(np.asarray(given.sigma) != 0))


def _in_unit(pixels: NDArray[Any]) -> bool:
    return pixels.size > 0 and bool(np.nanmin(pixels) >= 0 and np.nanmax(pixels) <= 1)


def rescaled(pixels: NDArray[Any], inside: NDArray[np.bool_] | None, colored: bool) -> Array:
    """Values from 0 to 1 within the mask, 0 outside of it; of any type of numbers."""
    if pixels.dtype.kind not in "biuf":
        raise TypeError(f"image: expected an array of numbers, got {pixels.dtype}")
    if pixels.size == 0:
        raise ValueError(f"image: expected at least one pixel, got {pixels.shape}")
    values = pixels.astype(np.float64)
    if inside is not None:
        values = np.where(inside[..., None] if colored else inside, values, np.nan)
        seen = values[inside]
    else:
        seen = values
    low, high = float(seen.min()), float(seen.max())
    if not (np.isfinite(low) and np.isfinite(high)):
        raise ValueError(
            "image: expected finite values, got NaN or infinity; replace them or mask them out with mask"
        )
    out = (values - low) / (high - low if high > low else 1.0)
    return np.where(np.isnan(out), 0.0, out)


def numbers_of_axes(value: Any, name: str, axes: int) -> Array:
    """A number for each spatial axis; as scikit-image takes it, three for an image with a warning."""
    try:
        out = np.asarray(value, np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected a number for each axis, got {value!r}") from None
    if axes == 2 and len(out) == 3:
        warnings.warn(
            f"Input image is 2D: {name} number of elements must be 2. In the future, a ValueError will be raised.",
            FutureWarning,
            stacklevel=4,
        )
        out = out[1:]
    if len(out) != axes:
        raise ValueError(f"Input image is {axes}D, but {name} has {len(out)} elements (expected {axes}).")
    if not (np.isfinite(out).all() and (out >= 0).all()):
        raise ValueError(f"{name}: expected finite numbers of at least 0, got {value!r}")
    return out


def smooth(values: Array, given: Given, colored: bool) -> Array:
    """Gaussian blur of each channel; a single sigma is divided by the spacing."""
    axes = values.ndim - colored
    if not _blurs(given):
        return values
    if np.isscalar(given.sigma):
        sigma = numbers_of_axes([given.sigma] * axes, "sigma", axes) / spacing_of(given, axes)
    else:
        sigma = numbers_of_axes(given.sigma, "sigma", axes)
    if not (sigma > 0).any():
        return values
    from scipy.ndimage import gaussian_filter

    # Reflected at its borders, an image that is blurred by twice its side is even; a wider kernel only needs memory.
    even = sigma > 2 * np.asarray(values.shape[:axes])
    for axis in np.flatnonzero(even):
        values = np.broadcast_to(values.mean(axis=axis, keepdims=True), values.shape)
    sigma = np.where(even, 0.0, sigma)
    out: Array = gaussian_filter(values, [*sigma, 0] if colored else list(sigma), mode="reflect")
    return out


def spacing_of(given: Given, axes: int) -> Array:
    """Distance between pixels along each spatial axis."""
    if given.spacing is None:
        return np.ones(axes)
    if np.isscalar(given.spacing):
        raise TypeError("spacing must be None or iterable.")
    out = numbers_of_axes(given.spacing, "spacing", axes)
    if not (out > 0).all():
        raise ValueError(f"spacing: expected numbers above 0, got {given.spacing!r}")
    return out


def lab_of(values: Array) -> Array:
    """L*, a* and b* of RGB in 0..1, of any number of axes, to the bits of scikit-image."""
    linear = np.where(values > 0.04045, np.power((values + 0.055) / 1.055, 2.4), values / 12.92)
    f = linear @ RGB_TO_XYZ.T / WHITE_XYZ
    x, y, z = np.moveaxis(np.where(f > 0.008856, np.cbrt(f), 7.787 * f + 16.0 / 116.0), -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)
