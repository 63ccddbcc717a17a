# SPDX-License-Identifier: MIT
"""The parts of a reconstruction: evidence of one frame, level-set evolution, and redistancing.

`Reconstructor` does not need them; they are for experiments with the method (docs/math/reconstruction.md).
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import mask_of, number, numbers, of_kind, one_of, positive, shown, whole
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.device import device_number
from sdftrack.frame import Frame
from sdftrack.geometry import rigid
from sdftrack.sdf import SDF
from sdftrack.sdf.volume import checked_values

__all__ = ["evidence", "evolve", "redistance"]

Grid: TypeAlias = SDF | tuple[tuple[int, int, int], float, ArrayLike]


def evidence(
    frame: Frame,
    camera: Camera | RGBDCamera,
    T_cam_obj: ArrayLike,
    grid: Grid,
    *,
    form: Literal["smooth", "printed"] = "smooth",
    sigma_d_m: float = 0.003,
    noise_m: float = 0.001,
    noise_per_m: float = 0.0,
    mask: ArrayLike | None = None,
    threads: int = 0,
) -> NDArray[np.float32]:
    """Log likelihood ratio (inside to outside) of each voxel given one frame (docs/math/reconstruction.md, 1).

    Parameters
    ----------
    frame : Frame
        With a depth image (m). Pixels without a measurement, and those next to a depth discontinuity, are ignored.
    camera : Camera or RGBDCamera
        Of the depth image.
    T_cam_obj : (4, 4) array
        Maps object coordinates to camera coordinates, m.
    grid : SDF or (shape, voxel_size, origin)
        The voxel grid: that of a volume, or shape (nz, ny, nx), m, and the object coordinates (x, y, z) of the centre
        of voxel [0, 0, 0], m.
    form : "smooth" or "printed"
        "printed" is the form of the thesis (4.29 to 4.31) along the ray of the nearest pixel, infinite at the surface
        and here limited to +-10. "smooth" accounts for surface slope and noise, stays within +-2.94, and carves free
        space in front of each measurement.
    sigma_d_m : float
        Support of the likelihood on either side of a depth measurement, m. With "smooth", nothing is inferred from
        twice that distance behind it.
    noise_m, noise_per_m : float
        The standard deviation of a measurement at depth Z is noise_m + noise_per_m Z^2, m and 1/m, but at least one
        voxel.
    mask : (H, W) bool or uint8, optional
        0 = not the object; such measurements only imply free space in front of them. Default: the mask of the frame;
        without one every measurement belongs to the object. With "printed", measurements outside the mask are ignored.
    threads : int
        0: all cores.

    Returns
    -------
    (nz, ny, nx) float32
        Positive inside, negative outside, 0 without information. With "smooth", it is weighted by the cosine between
        ray and surface normal, and reduced at depths where the noise exceeds noise_m and a voxel.

    Raises
    ------
    TypeError
        `frame` or `grid` of the wrong type.
    ValueError
        No depth image, inconsistent sizes, a pose that is not rigid, a length that is not positive.

    Examples
    --------
    >>> import sdftrack as st
    >>> ball = st.SDF.sphere(0.05, voxels=40)
    >>> sequence = st.synth.sequence(ball, 1)
    >>> ratio = st.levelset.evidence(sequence[0], sequence.camera, sequence.ground_truth[0][0], ball)
    >>> ratio.shape
    (40, 40, 40)
    """
    of_kind(frame, Frame, "frame")
    if frame.depth is None:
        raise ValueError(
            f"frame: expected a depth image, got none{': ' + frame.error if frame.error else ''}"
        )
    view = depth_camera(camera)
    shape, voxel_m, origin = _grid(grid)
    growth = number(noise_per_m, "noise_per_m")
    if not 0 <= growth < np.inf:
        raise ValueError(f"noise_per_m: expected 0 or more, got {noise_per_m}")
    options = _core.ReconstructionOptions(
        evidence=one_of(form, ("smooth", "printed"), "form"),
        sigma_d_m=positive(sigma_d_m, "sigma_d_m"),
        noise_m=positive(noise_m, "noise_m"),
        noise_per_m=growth,
    )
    given = frame.mask if mask is None else mask
    on = np.ones(frame.depth.shape, bool) if given is None else mask_of(given, frame.depth.shape)
    core = _core.Reconstruction(
        list(shape[::-1]), voxel_m, origin.tolist(), None, options, threads, usual_noise_m=noise_m
    )
    region = [0, 0, view.width, view.height]
    core.fuse(frame.depth, view._core, rigid(T_cam_obj, "T_cam_obj"), region, on.view(np.uint8))
    return np.array(core.log_ratio)


def evolve(
    phi: ArrayLike,
    log_ratio: ArrayLike,
    steps: int,
    voxel_size: float,
    *,
    regulariser: Literal["double_well", "printed"] = "double_well",
    sigma_h: float = 4.0,
    sigma_phi: float = 3.0,
    dt: float = 1.0,
    redistance_every: int = 5,
    threads: int = 0,
    device: str = "cpu",
) -> NDArray[np.float32]:
    """Steps of the gradient flow of the thesis (4.40 to 4.42, corrected; docs/math/reconstruction.md, 4).

    Parameters
    ----------
    phi : (nz, ny, nx) float32
        Signed distance (m), negative inside.
    log_ratio : (nz, ny, nx) float32
        Log ratio of inside to outside, summed over all frames, plus the logit of the initial guess, if any.
    steps : int
        Number of steps; in each, the front moves by at most dt / (2 sigma_h) voxels.
    voxel_size : float
        m.
    regulariser : "double_well" or "printed"
        Regulariser that keeps |grad phi| at 1: the potential of Li, Xu, Gui and Fox (2010), or that of the thesis
        (4.39).
    sigma_h, sigma_phi : float
        Widths of the Heaviside (4.38) and of the prior on |grad phi| (4.39), voxels.
    dt : float
        Step size.
    redistance_every : int
        Number of steps after which phi is reinitialised to a signed distance function (also after the last step), which
        the regulariser alone does not maintain. 0: never.
    threads : int
        0: all cores. The result is the same bits for any number.
    device : {"cpu", "cuda", "cuda:N", "auto"}
        Where the steps are computed and phi is reinitialised. A GPU agrees with the CPU to 1e-4 voxels after
        ten steps.

    Returns
    -------
    (nz, ny, nx) float32
        m.

    Raises
    ------
    TypeError
        Another dtype.
    RuntimeError
        ``device="cuda"`` without one.
    ValueError
        Different shapes, non-finite values, a field of one sign only, or a step size beyond the stability limit (the
        message states the limit).

    Examples
    --------
    >>> import sdftrack as st
    >>> ball = st.SDF.sphere(0.05, voxels=40)
    >>> phi = st.levelset.evolve(ball.values, -ball.values, 5, ball.voxel_size)
    """
    field, ratio = checked_values(phi, "phi"), checked_values(log_ratio, "log_ratio")
    if ratio.shape != field.shape:
        raise ValueError(f"log_ratio: expected the shape of phi, {field.shape}, got {ratio.shape}")
    _two_signs(field)
    printed = one_of(regulariser, ("double_well", "printed"), "regulariser") == "printed"
    left, every = whole(steps, "steps", 0), whole(redistance_every, "redistance_every", 0)
    voxel_m = positive(voxel_size, "voxel_size")
    number_of_gpu = device_number(device)
    options = _core.EvolveOptions()
    options.printed = printed
    options.sigma_h, options.sigma_phi = number(sigma_h, "sigma_h"), number(sigma_phi, "sigma_phi")
    options.dt = number(dt, "dt")
    out = _core.evolve(field, ratio, voxel_m, 0, options, threads)  # checks the options
    while left > 0:
        now = min(left, every or left)
        out = _core.evolve(out, ratio, voxel_m, now, options, threads, number_of_gpu)
        left -= now
        if every and _has_two_signs(out):  # else the shape has gone, or fills the volume
            out = _core.redistance(out, voxel_m, threads, number_of_gpu)
    return out


def redistance(
    phi: ArrayLike, voxel_size: float, *, threads: int = 0, device: str = "cpu"
) -> NDArray[np.float32]:
    """Signed distance to the zero set of a field: exact near it, by fast sweeping farther away.

    Parameters
    ----------
    phi : (nz, ny, nx) float32
        Any field, negative inside.
    voxel_size : float
        m.
    threads : int
        0: all cores.
    device : {"cpu", "cuda", "cuda:N", "auto"}
        A GPU agrees with the CPU to 1e-4 voxels, and to the bits near the zero set.

    Returns
    -------
    (nz, ny, nx) float32
        m.

    Raises
    ------
    TypeError
        Another dtype.
    ValueError
        Non-finite values, or a field of one sign only.

    Examples
    --------
    >>> import sdftrack as st
    >>> ball = st.SDF.sphere(0.05, voxels=40)
    >>> phi = st.levelset.redistance(3 * ball.values, ball.voxel_size)
    """
    field = checked_values(phi, "phi")
    _two_signs(field)
    return _core.redistance(field, positive(voxel_size, "voxel_size"), threads, device_number(device))


def _grid(grid: Any) -> tuple[tuple[int, int, int], float, NDArray[np.float64]]:
    if isinstance(grid, SDF):
        nz, ny, nx = grid.values.shape
        return (nz, ny, nx), grid.voxel_size, np.asarray(grid.origin, np.float64)
    if not isinstance(grid, tuple) or len(grid) != 3:
        raise TypeError(f"grid: expected st.SDF or (shape, voxel_size, origin), got {type(grid).__name__}")
    shape, origin = numbers(grid[0], "grid: shape"), numbers(grid[2], "grid: origin")
    if shape.shape != (3,) or not (shape >= 2).all() or (shape != np.floor(shape)).any():
        raise ValueError(
            f"grid: expected (nz, ny, nx) with at least 2 voxels along each axis, got {shown(grid[0])}"
        )
    if shape.prod() >= 2**31:
        raise ValueError(f"grid: expected fewer than 2^31 voxels, got {shown(grid[0])}")
    if origin.shape != (3,) or not np.isfinite(origin).all():
        raise ValueError(f"grid: expected an origin of three finite numbers (m), got {shown(grid[2])}")
    nz, ny, nx = (int(n) for n in shape)
    return (nz, ny, nx), positive(grid[1], "grid: voxel_size"), origin


def _has_two_signs(phi: NDArray[np.float32]) -> bool:
    return bool((phi < 0).any() and (phi >= 0).any())


def _two_signs(phi: NDArray[np.float32]) -> None:
    if not _has_two_signs(phi):
        raise ValueError("phi: expected negative (inside) and positive (outside) values, got one sign only")
