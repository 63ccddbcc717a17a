# SPDX-License-Identifier: MIT
"""A pair of depth (metres) and colour images, validated once when it enters the library."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.array_equality import same
from sdftrack._internal.validation import INT_MAX, mask_of, number, one_of, whole
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.device import host_array

PLAUSIBLE_DEPTH_M = (0.05, 50.0)
_GRID_PIXELS = 1000


class Frame:
    """A depth image, a colour image, or both, with a timestamp.

    Parameters
    ----------
    depth : (H, W) array or None
        On the host; with a CUDA build also on a GPU (DLPack or ``__cuda_array_interface__``), from which it is copied.
        float32 metres (used without a copy when C-contiguous and valid), float64 metres (copied), or uint16 with
        `depth_scale`. 0, NaN, infinite and negative pixels mean "no measurement". None: colour only. A lattice of
        holes of one or two pixels, as depth has that was warped into a larger image, is filled between its neighbours;
        fits, calibrations and files that are written leave out what was filled.
    color : (h, w, 3) uint8, optional
        Any strides; its size may differ from that of `depth` if the camera holds the mapping between them.
    timestamp : float, optional
        Seconds on any clock.
    depth_scale : float, optional
        Metres per unit of a uint16 depth image (RealSense and most sensors: 0.001; not Open3D's 1000 and not
        BOP's millimetres).
    color_order : "rgb" or "bgr"
        Channel order of `color` (OpenCV reads bgr); stored as rgb.
    mask : (H, W) bool or uint8, optional
        0 = not the object. Aligned with `depth` (with `color` if there is no depth).
    camera : Camera or RGBDCamera, optional
        The camera of this frame, if it differs between images.
    index : int, optional
        Index of the frame in its sequence.
    check_units : bool
        False accepts a median depth outside 0.05..50 m.

    Attributes
    ----------
    depth : (H, W) float32 C-contiguous, read-only, m, 0 = no measurement; or None
    color : (h, w, 3) uint8 C-contiguous, read-only, RGB; or None
    mask : (H, W) bool, read-only; or None
    error : str
        "", or the reason why the images of this frame could not be read; depth and color are then None.

    Raises
    ------
    TypeError
        A dtype other than those above.
    ValueError
        Wrong shape, inconsistent sizes, or an implausible unit.
    """

    __slots__ = ("_given", "camera", "color", "depth", "error", "index", "mask", "timestamp")

    depth: NDArray[np.float32] | None
    _given: NDArray[np.float32] | None  # the depth before holes were filled, m; None: the same
    color: NDArray[np.uint8] | None
    timestamp: float | None
    mask: NDArray[np.bool_] | None
    camera: Camera | RGBDCamera | None
    index: int | None
    error: str

    def __init__(
        self,
        depth: ArrayLike | None,
        color: ArrayLike | None = None,
        timestamp: float | None = None,
        *,
        depth_scale: float | None = None,
        color_order: str = "rgb",
        mask: ArrayLike | None = None,
        camera: Camera | RGBDCamera | None = None,
        index: int | None = None,
        check_units: bool = True,
    ) -> None:
        if depth is None and color is None:
            raise ValueError("depth, color: expected at least one image, got None for both")
        if camera is not None:
            depth_camera(camera)
        if timestamp is not None and not math.isfinite(number(timestamp, "timestamp")):
            raise ValueError(f"timestamp: expected seconds or None, got {timestamp}")
        self.depth = self._given = None
        if depth is not None:
            metres = _depth_m(host_array(depth, "depth"), depth_scale, check_units)
            filled = _core.without_lattice(metres)
            self.depth = _read_only(filled)
            self._given = None if filled is metres else _read_only(metres)
        self.color = None if color is None else _rgb(host_array(color, "color"), color_order)
        self.timestamp = None if timestamp is None else float(timestamp)
        self.camera = camera
        self.index = None if index is None else whole(index, "index", -INT_MAX)
        self.error = ""
        if self.depth is not None and camera is not None and self.depth.shape != depth_camera(camera).shape:
            raise ValueError(
                f"depth: expected the camera's (height, width) = {depth_camera(camera).shape}, "
                f"got {self.depth.shape}"
            )
        self.mask = None if mask is None else _read_only(mask_of(host_array(mask, "mask"), self.shape))

    @classmethod
    def unreadable(cls, error: str, timestamp: float | None = None, index: int | None = None) -> Frame:
        """Return a frame without images; a tracker reports it as a bad frame with `error` as the reason."""
        frame = cls.__new__(cls)
        frame.depth = frame._given = frame.color = frame.mask = frame.camera = None
        frame.timestamp, frame.index, frame.error = timestamp, index, error
        return frame

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) of the depth image (of the colour image when there is no depth)."""
        image = self.depth if self.depth is not None else self.color
        return (0, 0) if image is None else (image.shape[0], image.shape[1])

    def replace(self, **changes: Any) -> Frame:
        """Return a copy with some attributes changed; unchanged images are shared."""
        values = {name: getattr(self, name) for name in self.__slots__ if name not in ("_given", "error")}
        values["depth"] = as_given(self).depth
        if self.error:
            return Frame.unreadable(
                self.error, **{k: changes.get(k, values[k]) for k in ("timestamp", "index")}
            )
        return Frame(**{**values, "check_units": False, **changes})

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Frame):
            return NotImplemented
        return same(self.__reduce__()[1], other.__reduce__()[1])

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return _restore, tuple(getattr(self, name) for name in self.__slots__)

    def __repr__(self) -> str:
        if self.error:
            return f"Frame(error={self.error!r})"
        parts = []
        if self.depth is not None:
            valid = self.depth[self.depth > 0]
            span = f"{valid.min():.3g}..{valid.max():.3g} m" if valid.size else "no measurement"
            parts.append(f"depth {self.depth.shape[1]} x {self.depth.shape[0]} {span}")
        if self.color is not None:
            parts.append(f"color {self.color.shape[1]} x {self.color.shape[0]}")
        if self.timestamp is not None:
            parts.append(f"t = {self.timestamp:.6g} s")
        if self.index is not None:
            parts.append(f"index {self.index}")
        return f"Frame({', '.join(parts)})"

    def _repr_png_(self) -> bytes | None:
        import cv2

        pictures = []
        if self.color is not None:
            pictures.append(self.color[..., ::-1])
        if self.depth is not None:
            top = np.percentile(self.depth[self.depth > 0], 98) if (self.depth > 0).any() else 1.0
            grey = np.clip(255 * (1 - self.depth / top), 0, 255).astype(np.uint8)
            shaded = cv2.applyColorMap(grey, cv2.COLORMAP_TURBO)
            shaded[self.depth == 0] = 0
            pictures.append(shaded)
        if not pictures:
            return None
        height = min(240, *(p.shape[0] for p in pictures))
        small = [cv2.resize(p, (round(p.shape[1] * height / p.shape[0]), height)) for p in pictures]
        return bytes(cv2.imencode(".png", np.hstack(small))[1])


def as_given(frame: Frame) -> Frame:
    """Return the frame with its measurements alone: without what was filled in a lattice of holes."""
    if frame._given is None:
        return frame
    out = copy.copy(frame)
    out.depth, out._given = frame._given, None
    return out


def _restore(*values: Any) -> Frame:
    frame = Frame.__new__(Frame)
    for name, value in zip(Frame.__slots__, values, strict=True):
        setattr(frame, name, _read_only(value) if isinstance(value, np.ndarray) else value)
    return frame


def _depth_m(depth: NDArray[Any], depth_scale: float | None, check_units: bool) -> NDArray[np.float32]:
    metres: NDArray[np.float32]
    if depth.ndim != 2 or depth.size == 0:
        raise ValueError(f"depth: expected shape (H, W), got {depth.shape}; select a single channel")
    if depth.dtype.kind == "u" and depth.dtype.itemsize == 2:
        metres = _core.depth_metres(np.ascontiguousarray(depth, np.uint16), _checked_scale(depth_scale))
    elif depth.dtype.kind == "f" and depth.dtype.itemsize in (4, 8):
        if depth_scale is not None:
            raise ValueError(
                f"depth_scale: expected None with a {depth.dtype} depth image, which is already in metres, "
                f"got {depth_scale}"
            )
        metres = np.ascontiguousarray(depth, dtype=np.float32)
    else:
        raise TypeError(
            f"depth: expected float32 or float64 metres, or uint16 with depth_scale, got {depth.dtype}; "
            "convert with depth.astype(np.uint16) if these are sensor units, or to float metres"
        )
    # One pass each and no temporary: NaN makes both comparisons false.
    if not (metres.min() >= 0 and metres.max() < np.inf):
        metres = np.where(np.isfinite(metres) & (metres > 0), metres, np.float32(0))
    if check_units:
        _check_unit(metres, depth.dtype)
    return metres


def _checked_scale(depth_scale: float | None) -> float:
    if depth_scale is None:
        raise ValueError(
            "depth_scale: expected metres per unit for a uint16 depth image, got None; millimetres "
            "(RealSense, Kinect, Azure) are depth_scale=0.001, TUM's images 1/5000"
        )
    scale = number(depth_scale, "depth_scale")
    if not (math.isfinite(scale) and 0 < scale < 1):
        hint = f"; units per metre? then pass 1/{scale:g}" if scale > 1 and math.isfinite(scale) else ""
        if scale == 1:
            hint = "; BOP's 1 means millimetres, here 0.001"
        raise ValueError(f"depth_scale: expected metres per unit, between 0 and 1, got {scale:g}{hint}")
    return scale


def _check_unit(metres: NDArray[np.float32], dtype: np.dtype[Any]) -> None:
    step = max(1, math.isqrt(metres.size // _GRID_PIXELS))
    sample = metres[step // 2 :: step, step // 2 :: step]
    sample = sample[sample > 0]
    if not sample.size:
        return
    median = float(np.median(sample))
    low, high = PLAUSIBLE_DEPTH_M
    if low <= median <= high:
        return
    far, fix = median > high, "depth_scale" if dtype.kind == "u" else "depth"
    # The median as it would be were the image in another common unit.
    for name, metres_per_unit in (
        ("millimetres", 1e-3),
        ("tenths of a millimetre", 1e-4),
        ("centimetres", 1e-2),
    ):
        if far and 0.2 <= median * metres_per_unit <= 10:
            hint = f"it seems to be in {name}: multiply {fix} by {metres_per_unit:g}"
            break
    else:
        hint = f"expected metres: check {fix}"
        if not far and 0.2 <= median * 1000 <= 10:
            hint = f"it seems to be scaled by 0.001 twice (kilometres): multiply {fix} by 1000"
    raise ValueError(
        f"depth: expected a median within {low:g}..{high:g} m, got {median:g} m; {hint} "
        "(check_units=False skips this check)"
    )


def _rgb(color: NDArray[Any], color_order: str) -> NDArray[np.uint8]:
    one_of(color_order, ("rgb", "bgr"), "color_order")
    if color.dtype != np.uint8:
        raise TypeError(f"color: expected uint8, got {color.dtype}; scale to 0..255 and convert")
    if color.ndim != 3 or color.shape[2] != 3 or color.size == 0:
        fix = ""
        if color.ndim == 3 and color.shape[2] == 4:
            fix = "; drop the alpha channel with color[..., :3]"
        elif color.ndim == 2:
            fix = "; repeat a grey image with np.repeat(grey[..., None], 3, axis=2)"
        raise ValueError(f"color: expected shape (H, W, 3), got {color.shape}{fix}")
    return _read_only(np.ascontiguousarray(color if color_order == "rgb" else color[..., ::-1]))


def _read_only(a: NDArray[Any]) -> NDArray[Any]:
    view = a.view()
    view.flags.writeable = False
    return view
