# SPDX-License-Identifier: MIT
"""The second half of ``sdftrack demo``: reconstruction of the duck while it rotates in front of the camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.cli.progress import progress

__all__ = ["Reconstruction", "duck_mask", "reconstruct_duck"]

VOXELS, ROUNDS = 128, 1  # half a millimetre on the mean, in a quarter of the demo's minute
WHOLE_TURN = 60  # frames
PLACE_M, TILT_RAD = (0.0, -0.05, 0.22), 0.6  # over the table
ON_DUCK_M = 0.02
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reconstruction:
    """Result of the reconstruction.

    Attributes
    ----------
    mesh : Mesh, its own object frame
    pose : (4, 4) T_cam_obj in the first image
    T_duck_obj : (4, 4) from the mesh's object frame to the true duck's
    distances_m : of the mesh's seen vertices from the true surface
    seen_share : of the surface, 0..1
    min_seen : minimum ``mesh.seen`` of an observed vertex
    summary : how much of it was seen, for people
    frames : of the turn
    seconds : per frame, of tracking and fusing
    """

    mesh: Any
    pose: Array
    T_duck_obj: Array
    distances_m: Array
    seen_share: float
    min_seen: float
    summary: str
    frames: int
    seconds: float

    def section(self) -> dict[str, Any]:
        """For report.json."""
        return {
            "summary": self.summary,
            "seen_share": self.seen_share,
            "mean_distance_m": float(self.distances_m.mean()),
            "largest_distance_m": float(self.distances_m.max()),
            "frames": self.frames,
            "voxels": VOXELS,
            "seconds_per_frame": self.seconds,
            "T_duck_obj": self.T_duck_obj,
        }

    def row(self) -> list[str]:
        """For the demo's table: mean, median, largest."""
        mm = 1e3 * self.distances_m
        return [
            "reconstructed surface (mm)",
            *(f"{v:.2f}" for v in (mm.mean(), np.median(mm), mm.max())),
        ]


def reconstruct_duck(scene: Any, sdf: Any, frames: int, threads: int, quiet: bool) -> Reconstruction:
    """Rotate the demo's duck once in 60 frames and reconstruct it; `sdf` is the true shape for comparison."""
    import sdftrack as st
    from sdftrack.synth.demo_scene import alone

    turned = alone(scene, PLACE_M, _turn(frames))
    star = st.Reconstructor(scene.camera, voxels=VOXELS, threads=threads)
    seconds = []
    for i, frame in enumerate(progress(turned.frames(), len(turned), "reconstructing", quiet)):
        if i == 0:
            result = star.start(frame, mask=duck_mask(frame, sdf, scene.camera, turned.poses[0]))
            first = result.pose
        else:
            result = star.track(frame)
        seconds.append(result.seconds)
    star.refine(rounds=ROUNDS)
    mesh, quality = star.mesh(), star.quality()
    assert mesh.seen is not None
    T_duck_obj = np.linalg.solve(turned.poses[0], first)
    seen = mesh.vertices[mesh.seen >= star.options.min_seen]
    return Reconstruction(
        mesh=mesh,
        pose=first,
        T_duck_obj=T_duck_obj,
        distances_m=np.abs(sdf(seen @ T_duck_obj[:3, :3].T + T_duck_obj[:3, 3])),
        seen_share=quality.seen_share,
        min_seen=star.options.min_seen,
        summary=quality.summary,
        frames=frames,
        seconds=float(np.mean(seconds[1:])),
    )


def _turn(frames: int) -> Array:
    """(frames, 3) angles: round the duck's upright axis, tilted up and down so that its underside is seen too."""
    a = 2 * np.pi * np.arange(frames) / WHOLE_TURN
    return np.stack([TILT_RAD * np.sin(2 * a), np.zeros(frames), a], axis=1)


def duck_mask(frame: Any, sdf: Any, camera: Any, T: Array) -> NDArray[np.bool_]:
    """The duck's pixels, as a hand-drawn mask would have them."""
    depth = sdf.render(camera, T)[0]
    on_duck: NDArray[np.bool_] = (depth > 0) & (np.abs(frame.depth - depth) < ON_DUCK_M)
    return on_duck
