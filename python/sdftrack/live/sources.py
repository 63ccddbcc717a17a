# SPDX-License-Identifier: MIT
"""What a camera's driver has to offer, and the registration of drivers by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from sdftrack.camera import RGBDCamera
from sdftrack.frame import Frame


class CameraLost(OSError):
    """The camera stopped delivering frames: unplugged, or its driver failed. It may come back."""


class FrameSource(Protocol):
    """A device that delivers frames, one after the other.

    Attributes
    ----------
    camera : RGBDCamera
        Depth camera and, if colour is streamed, the mapping to the colour image.
    name : str
        For messages: "RealSense D435 (serial 0123)".
    """

    camera: RGBDCamera
    name: str

    def read(self) -> Frame | None:
        """Wait for the next frame; its timestamp is the camera's, in seconds. None: the stream has ended.

        Raises `CameraLost` if no frame arrives within a time that is long for this device.
        """

    def reopen(self) -> None:
        """Connect again after `CameraLost`; raises `CameraLost` while the camera is not there."""

    def close(self) -> None:
        """Release the device; a second call does nothing."""


@dataclass(frozen=True)
class CameraKind:
    """A kind of camera: its name before the colon, what follows the colon, and its driver."""

    name: str
    address: str
    open: Callable[..., FrameSource]


CAMERAS: dict[str, CameraKind] = {}
"""The kinds of cameras by name; filled when a camera is opened."""


def register_camera(name: str, address: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator that makes `function(address, **options) -> FrameSource` the driver of cameras called `name`.

    `address` says in a few words what may follow the colon, for messages: "serial number".
    """

    def add(function: Callable[..., Any]) -> Callable[..., Any]:
        CAMERAS[name] = CameraKind(name, address, function)
        return function

    return add
