# SPDX-License-Identifier: MIT
"""Segmentation of single images and of video."""

from __future__ import annotations

from typing import Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import THREADS, number, one_of, whole
from sdftrack.device import CPU, device_input, device_number
from sdftrack.superpixels.arguments import (
    as_theirs,
    checked_depth,
    checked_image,
    checked_mask,
    checked_shape,
    checked_values,
    core_labels,
    given_image,
    is_theirs,
    taken,
)

Labels = NDArray[np.int32]
SPACES = ("lab", "xyz", "rgb")
DISTANCES = ("slic", "thesis")
MAX_COUNT = 2**30  # segments, rounds, first label


def slic(
    image: ArrayLike,
    n_segments: int = 100,
    compactness: float = 10.0,
    max_num_iter: int = 5,
    *,
    color_space: Literal["lab", "xyz", "rgb"] = "lab",
    start_label: int = 1,
    mask: ArrayLike | None = None,
    enforce_connectivity: bool = True,
    distance: Literal["slic", "thesis"] = "slic",
    min_size_factor: float = 0.25,
    depth: ArrayLike | None = None,
    depth_weight: float = 20.0,
    threads: int = 0,
    device: str = "auto",
    **scikit_image: Any,
) -> Labels:
    """Superpixels by simple linear iterative clustering (Achanta et al. 2012; appendix A).

    The arguments and the scale of `compactness` are those of ``skimage.segmentation.slic``. The result is the same
    whatever the number of threads, the processor and the device.

    Parameters
    ----------
    image : (H, W, 3) RGB or (H, W) grey array of uint8, or of float in 0..1
        Any strides; arrays that are not C-contiguous are copied.
    n_segments : int
        Approximate number of segments; if it exceeds the number of pixels, one per pixel.
    compactness : float
        m in ``D^2 = d_lab^2 + (m d_xy / S)^2``, above 0 and up to 4000; larger: rounder segments.
    max_num_iter : int
        Maximum number of k-means iterations; stops earlier if no centre moves.
    color_space : {"lab", "xyz", "rgb"}
        CIELAB (D65), or XYZ or RGB in percent (0..100, so that `compactness` has a similar scale).
    start_label : int
        The first label, at least 0, and at least 1 with a mask.
    mask : (H, W) bool array, optional
        Only these pixels are segmented; the grid of centres covers their bounding rectangle.
    enforce_connectivity : bool
        Make each segment 4-connected; segments smaller than `min_size_factor` are merged into their largest neighbour.
    distance : {"slic", "thesis"}
        ``"thesis"``: ``D = d_lab + (m / S) d_xy`` (A.1).
    min_size_factor : float
        Minimum segment size relative to the mean size (pixels / `n_segments`).
    depth : (H, W) array, optional
        Metres, 0 or NaN: missing (replaced by the measurement to the left). Adds `depth_weight` x depth as a fourth
        colour channel.
    depth_weight : float
        Units of colour per metre, above 0; `depth_weight` x the largest depth at most 200.
    threads : int
        0: all cores.
    device : {"auto", "cpu", "cuda", "cuda:N"}
    **scikit_image
        ``channel_axis``, ``sigma``, ``spacing``, ``convert2lab``, ``slic_zero`` and ``max_size_factor`` as there. Blur,
        volumes, other numbers of channels, ``channel_axis=None``, ``convert2lab=False``, ``spacing`` and
        ``slic_zero=True`` are computed by scikit-image (extra ``superpixels``), with our defaults for the rest.

    Returns
    -------
    (H, W) int32 array
        `start_label`, `start_label` + 1, ... in raster order of the segments (without connectivity: of the grid); 0
        outside the mask. Of an image of uint8 on the GPU that is used, without mask and depth, an array there for
        ``from_dlpack`` of torch, cupy or jax: nothing is copied.

    Raises
    ------
    TypeError
        Unsupported dtype of image, mask or number.
    ValueError
        A wrong shape, values outside 0..1 or not finite, an empty mask, a number out of range.
    RuntimeError
        ``device="cuda"`` without one.
    ImportError
        An argument or image that is computed by scikit-image, which is not installed.
    MemoryError
        The image is too large; the message states the memory required.

    Examples
    --------
    >>> import numpy as np, sdftrack as st
    >>> image = np.zeros((60, 80, 3), np.uint8); image[:, 40:] = (200, 80, 40)
    >>> labels = st.superpixels.slic(image, n_segments=12)
    >>> int(labels.min()), bool((labels[:, 39] != labels[:, 40]).all())
    (1, True)
    """
    options = _options(locals(), max_num_iter)
    given, number = taken(scikit_image), device_number(device)
    workers = whole(threads, "threads", 0, MAX_COUNT, THREADS)
    if mask is None and depth is None and not scikit_image:
        there = device_input(image, "image", number)
        if (
            there is not None
            and there.dtype == np.uint8
            and there.shape[2:] in ((), (3,))
            and len(there.shape) > 1
        ):
            height, width = there.shape[:2]
            channels = 3 if len(there.shape) == 3 else 1
            found: Any = _core.slic_there(
                there.address, there.stream, height, width, channels, options, number
            )
            return cast(Labels, found)
    pixels, colored = given_image(image, given)
    if is_theirs(pixels, colored, given):
        for name, other in (("depth", depth is not None), ("distance", distance != "slic")):
            if other:
                raise ValueError(f"{name}: not taken with scikit-image's arguments and images; omit {name}")
        inside = checked_mask(mask, pixels.shape[: pixels.ndim - colored], start_label)
        return as_theirs(pixels, colored, given, inside, options)
    pixels = checked_shape(pixels)
    inside = checked_mask(mask, pixels.shape[:2], start_label)
    pixels = checked_values(pixels, inside)
    seen = checked_depth(depth, pixels.shape[:2], depth_weight)
    options.depth_weight = float(depth_weight) if seen is not None else 0.0
    return core_labels(pixels, inside, seen, options, workers, number)


class Video:
    """Superpixels of a video: each image starts from the centres of the previous one and needs fewer iterations.

    Parameters
    ----------
    n_segments, compactness, color_space, start_label, enforce_connectivity, distance, min_size_factor, threads
        As in `slic`.
    first_num_iter, max_num_iter : int
        Maximum number of iterations for the first image, and for the following ones.

    Attributes
    ----------
    iterations, segments : int
        Numbers of iterations and segments in the last image.
    residual : float
        Movement of the centres in the last iteration, in units of colour.

    Examples
    --------
    >>> import numpy as np, sdftrack as st
    >>> video = st.superpixels.Video(n_segments=50)
    >>> frames = [np.full((48, 64, 3), 10 * i, np.uint8) for i in range(3)]
    >>> [video.next(frame).shape for frame in frames]
    [(48, 64), (48, 64), (48, 64)]
    """

    def __init__(
        self,
        n_segments: int = 100,
        compactness: float = 10.0,
        max_num_iter: int = 2,
        *,
        first_num_iter: int = 5,
        color_space: Literal["lab", "xyz", "rgb"] = "lab",
        start_label: int = 1,
        enforce_connectivity: bool = True,
        distance: Literal["slic", "thesis"] = "slic",
        min_size_factor: float = 0.25,
        threads: int = 0,
    ) -> None:
        given = dict(locals())
        self._options = [_options(given, rounds) for rounds in (first_num_iter, max_num_iter)]
        self._threads = whole(threads, "threads", 0, MAX_COUNT, THREADS)
        self._work = _core.SlicWork()
        self._shape: tuple[int, ...] | None = None
        self.iterations, self.segments, self.residual = 0, 0, float("nan")

    def next(self, image: ArrayLike) -> Labels:
        """Labels of the next image, as in `slic`; an image of another size restarts.

        Labels are not consistent between images: they follow the raster order in each image.
        """
        pixels = checked_image(image)
        resume = self._shape == pixels.shape[:2]
        self._shape = None  # until this has gone well
        labels, self.segments, self.iterations, self.residual, _ = self._work.run(
            pixels, self._options[resume], None, None, resume, self._threads, CPU
        )
        self._shape = pixels.shape[:2]
        made: Labels = labels
        return made

    def reset(self) -> None:
        """Forget the centres: the next image starts from the grid."""
        self._shape = None


def _options(given: dict[str, Any], rounds: int) -> Any:
    """The core's options from the arguments of `slic` and `Video`."""
    options = _core.SlicOptions()
    options.n_segments = whole(given["n_segments"], "n_segments", 1, MAX_COUNT)
    options.compactness = number(given["compactness"], "compactness")
    options.max_iterations = whole(rounds, "max_num_iter", 1, MAX_COUNT)
    options.space = one_of(given["color_space"], SPACES, "color_space")
    options.first_label = whole(given["start_label"], "start_label", 0, MAX_COUNT)
    options.connected = bool(given["enforce_connectivity"])
    options.distance = one_of(given["distance"], DISTANCES, "distance")
    options.min_size = number(given["min_size_factor"], "min_size_factor")
    if not 0 <= options.min_size <= 1:
        raise ValueError(f"min_size_factor: expected a number from 0 to 1, got {given['min_size_factor']}")
    options.depth_weight = 0.0
    return options
