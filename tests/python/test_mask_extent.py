# SPDX-License-Identifier: MIT
"""A reconstruction that has grown beyond the mask that it began with says so."""

import numpy as np
import pytest
from reconstruction_parts import MaskExtent
from reconstruction_scene import CAMERA, first_mask, sequence

import sdftrack as st

FREE = {"keep_to_mask": False, "planes": False, "voxels": 64, "mode": "depth"}


def run(mask, **options):
    seq = sequence()
    star = st.Reconstructor(CAMERA, **{**FREE, **options})
    return star, [star.start(seq[0], mask=mask), *(star.track(seq[i]) for i in range(1, 12))]


def test_another_recording_that_is_added_is_ok_and_what_follows_is_weak():
    seq = sequence()
    star, results = run(half(first_mask(seq)))
    assert not results[-1].ok
    result = star.resume(seq[12], mask=seq.masks(12)[0])
    assert result.ok
    assert result.index == 12
    assert star.track(seq[13]).status == ["weak"]


def half(mask):
    """The mask without its left half: what is there joins the shape."""
    out = mask.copy()
    xs = np.nonzero(mask)[1]
    out[:, : int(np.median(xs))] = False
    return out


def test_a_shape_that_has_grown_beyond_its_mask_is_weak_with_the_reason():
    _, results = run(half(first_mask(sequence())))
    assert results[-1].status == ["weak"]
    assert "beyond the first mask" in results[-1].reason[0]
    assert results[-1].confidence[0] <= 0.5


def test_one_whose_mask_shows_all_of_it_is_not():
    assert all(r.ok or r.reason[0].startswith("undetermined") for r in run(first_mask(sequence()))[1])


def test_where_the_mask_bounds_the_shape_nothing_is_doubted():
    assert not any("beyond" in r.reason[0] for r in run(half(first_mask(sequence())), keep_to_mask=True)[1])


class Volume:
    """A core whose seen surface is a ball about the middle of its volume."""

    voxel_m, origin = 0.002, (-0.063, -0.063, -0.063)

    def __init__(self, radius_m):
        z, y, x = np.mgrid[:64, :64, :64]
        at = np.stack([x, y, z], -1) * self.voxel_m + self.origin
        self.phi = (np.linalg.norm(at, axis=-1) - radius_m).astype(np.float32)
        self.seen = np.full(self.phi.shape, 300, np.uint16)
        self.surface_boxes = np.array([[0, 0, 0, 64, 64, 64]], np.int32)


def disk(radius_px):
    y, x = np.mgrid[: CAMERA.height, : CAMERA.width]
    return np.hypot(x - CAMERA.cx, y - CAMERA.cy) <= radius_px


def test_a_volume_that_is_replaced_is_looked_at_again():
    T = np.eye(4)
    T[2, 3] = 0.5
    extent = MaskExtent(CAMERA, disk(15), T)
    assert extent.beyond(Volume(0.03), 1, 200) > 0.5
    assert extent.beyond(Volume(0.019), 2, 200) > 0.5  # not looked at again so soon
    extent.forget()
    assert extent.beyond(Volume(0.019), 2, 200) < 0.15


@pytest.mark.parametrize("ratio", [1.0, 1.3, 1.6])
def test_the_share_is_that_of_the_radii(ratio):
    radius_m, far_m = 0.03, 0.5
    seen_px = CAMERA.fx * radius_m / np.sqrt(far_m**2 - radius_m**2)
    T = np.eye(4)
    T[2, 3] = far_m
    found = MaskExtent(CAMERA, disk(seen_px / ratio), T).beyond(Volume(radius_m), 1, 200)
    assert found == pytest.approx(ratio - 1, abs=0.1)  # voxels are 1.6 pixels wide


def test_where_the_mask_ends_with_the_image_nothing_is_known():
    T = np.eye(4)
    T[2, 3] = 0.5
    cut = np.zeros((CAMERA.height, CAMERA.width), bool)
    cut[100:140, :12] = True
    T[0, 3] = -0.5 * CAMERA.cx / CAMERA.fx
    assert MaskExtent(CAMERA, cut, T).beyond(Volume(0.012), 1, 200) < 0.3
    beside = np.zeros_like(cut)
    beside[100:140, 1:12] = True
    assert MaskExtent(CAMERA, beside, T).beyond(Volume(0.012), 1, 200) > 0.5
