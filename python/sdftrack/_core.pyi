"""
Private core of sdftrack; use the names of the package sdftrack.
"""
from __future__ import annotations
import collections.abc
import numpy
import numpy.typing
import typing
__all__: list[str] = ['Camera', 'MeshCaster', 'cuda_available', 'cuda_build', 'cuda_device_name', 'nearest_rigid', 'rotation_exp', 'rotation_from_mrp', 'rotation_log', 'scale_and_add', 'thread_count']
class Camera:
    """
    Pinhole camera with Brown-Conrady distortion; see sdftrack.Camera.
    """
    def __init__(self, fx: typing.SupportsFloat | typing.SupportsIndex, fy: typing.SupportsFloat | typing.SupportsIndex, cx: typing.SupportsFloat | typing.SupportsIndex, cy: typing.SupportsFloat | typing.SupportsIndex, width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex, distortion: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = []) -> None:
        ...
    def project(self, points: numpy.ndarray) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) float64, m, camera frame -> (N, 2) pixels.
        """
    def rays(self) -> numpy.typing.NDArray[numpy.float32]:
        """
        (H, W, 2) float32: x / z and y / z of every pixel's ray, distortion removed.
        """
    @property
    def height(self) -> int:
        ...
    @property
    def width(self) -> int:
        ...
class MeshCaster:
    """
    Rays and closest points of one mesh. The arrays must not change.
    """
    def __init__(self, vertices: numpy.ndarray, faces: numpy.ndarray) -> None:
        ...
    def closest(self, points: numpy.ndarray) -> tuple:
        """
        (N, 3) float64 -> distances (N,) m, faces (N,) int32, points (N, 3).
        """
    def raycast(self, camera: Camera, T_cam_obj: numpy.ndarray, colors: numpy.ndarray | None = None, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> tuple:
        """
        -> depth (H, W) float32 m, normals (H, W, 3) float32, colours (H, W, 3) uint8 or None.
        """
def cuda_available() -> bool:
    """
    True when the build has CUDA and a device answers.
    """
def cuda_device_name() -> str:
    """
    Name of the current CUDA device; empty without one.
    """
def nearest_rigid(T: numpy.ndarray, name: str = 'T') -> numpy.typing.NDArray[numpy.float64]:
    """
    4x4 float64, rigid to within 1e-3, projected onto the rotations; ValueError beyond.
    """
def rotation_exp(w_rad: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> numpy.typing.NDArray[numpy.float64]:
    """
    Rotation vector to a 4x4 rotation.
    """
def rotation_from_mrp(r: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> numpy.typing.NDArray[numpy.float64]:
    """
    MRP to a 4x4 rotation.
    """
def rotation_log(T: numpy.ndarray) -> typing.Annotated[list[float], "FixedSize(3)"]:
    """
    Rotation vector (rad) of a 4x4 pose.
    """
def scale_and_add(a: typing.SupportsFloat | typing.SupportsIndex, x: numpy.ndarray, y: numpy.ndarray, *, cuda: bool = False) -> numpy.typing.NDArray[numpy.float32]:
    """
    a x + y of (N,) float32 arrays: the smallest kernel, to test the device.
    """
def thread_count(requested: typing.SupportsInt | typing.SupportsIndex = 0) -> int:
    """
    Threads used when `requested` are asked for.
    """
__version__: str = '0.1.0'
cuda_build: bool = False
