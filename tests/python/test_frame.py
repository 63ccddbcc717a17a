# SPDX-License-Identifier: MIT
import copy
import pickle

import numpy as np

import sdftrack as st

DEPTH = np.full((12, 16), 0.8, np.float32)
COLOR = np.arange(12 * 16 * 3, dtype=np.uint8).reshape(12, 16, 3)
CAMERA = st.Camera(20, 20, 7.5, 5.5, 16, 12)


def test_float32_metres_are_used_without_a_copy():
    frame = st.Frame(DEPTH)
    assert np.shares_memory(frame.depth, DEPTH)
    assert not frame.depth.flags.writeable
    assert DEPTH.flags.writeable


def test_other_depths_become_float32_metres():
    np.testing.assert_array_equal(st.Frame(DEPTH.astype(np.float64)).depth, DEPTH)
    raw = np.full((12, 16), 800, np.uint16)
    for image in (raw, raw.astype(">u2"), np.repeat(raw, 2, 1)[:, ::2]):
        frame = st.Frame(image, depth_scale=0.001)
        assert frame.depth.dtype == np.float32
        assert frame.depth.flags.c_contiguous
        np.testing.assert_allclose(frame.depth, 0.8, rtol=1e-6)


def test_any_strides_are_accepted():
    wide = np.repeat(DEPTH, 2, axis=1)
    assert st.Frame(wide[:, ::2], COLOR[::-1, ::-1]) == st.Frame(DEPTH, COLOR[::-1, ::-1].copy())


def test_pixels_without_a_value_become_zero():
    depth = DEPTH.copy()
    depth[0, :4] = np.nan, np.inf, -1, -np.inf
    frame = st.Frame(depth)
    assert (frame.depth[0, :4] == 0).all()
    assert (frame.depth[1:] == DEPTH[1:]).all()
    assert np.isnan(depth[0, 0])  # the caller's image is left as it was


def test_bgr_is_stored_as_rgb():
    frame = st.Frame(DEPTH, COLOR, color_order="bgr")
    np.testing.assert_array_equal(frame.color, COLOR[..., ::-1])
    assert frame.color.flags.c_contiguous


def test_masks_select_the_object():
    raw = np.zeros((12, 16), np.uint8)
    raw[3, 4] = 255
    assert st.Frame(DEPTH, mask=raw).mask.sum() == 1


def test_frames_are_values():
    frame = st.Frame(DEPTH, COLOR, 3.5, mask=DEPTH > 0, camera=CAMERA, index=7)
    for twin in (pickle.loads(pickle.dumps(frame)), copy.copy(frame), copy.deepcopy(frame)):
        assert twin == frame
        assert not twin.depth.flags.writeable
    assert frame != st.Frame(DEPTH, COLOR, 3.5, mask=DEPTH > 0, camera=CAMERA, index=8)
    assert frame.replace(index=8).index == 8
    assert repr(frame) == "Frame(depth 16 x 12 0.8..0.8 m, color 16 x 12, t = 3.5 s, index 7)"


def test_an_unreadable_frame_carries_its_reason():
    frame = st.Frame.unreadable("depth/000003.png: truncated", timestamp=0.1, index=3)
    assert frame.depth is None
    assert frame.color is None
    assert pickle.loads(pickle.dumps(frame)) == frame
    assert "truncated" in repr(frame)


def test_notebooks_get_a_picture():
    assert st.Frame(DEPTH, COLOR)._repr_png_().startswith(b"\x89PNG")
