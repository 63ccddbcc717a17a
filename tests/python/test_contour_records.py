# SPDX-License-Identifier: MIT
"""Results of the contour tracker and of the shape memory as records: equal, short, drawn, kept; options in files."""

import copy
import pickle

import numpy as np
import pytest

import sdftrack as st
from experiments.synth.blob import blob_video
from experiments.synth.gait import gait

SHORT = 110  # characters of a repr


@pytest.fixture(scope="module")
def contour_result():
    video = blob_video(frames=2)
    tracker = st.contour.ContourTracker()
    tracker.start(video.images[0], mask=video.masks[0])
    return tracker.track(video.images[1])


@pytest.fixture(scope="module")
def masks():
    return list(gait("cat", 24))


@pytest.fixture(scope="module")
def assessment(masks):
    memory = st.contour.ShapeMemory()
    for mask in masks[:20]:
        memory.learn(mask)
    return memory.assess(masks[21])


@pytest.fixture(params=["contour_result", "assessment"])
def record(request):
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda r: pickle.loads(pickle.dumps(r))])
def test_a_copy_is_equal_and_cannot_be_written(record, again):
    other = again(record)
    assert other == record
    for one in (record, other):
        with pytest.raises(ValueError, match="read-only"):
            one.mask[0, 0] = True


def test_the_repr_is_one_short_line_and_the_picture_a_png(record):
    assert len(repr(record)) < SHORT
    assert "\n" not in repr(record)
    assert record._repr_png_().startswith(b"\x89PNG")


NUMPYS = [
    {"n_harmonics": np.int64(8)},
    {"n_inputs": np.int32(2), "spacing": np.float32(0.02)},
    {"capacity": np.uint8(40), "w_gen": np.float16(0.25)},
    {"rule": "printed", "lwpr": {"init_D": np.array(3.0), "penalty": np.float32(1e-4)}},
]


@pytest.mark.parametrize("options", NUMPYS)
def test_a_memory_made_with_numpys_numbers_is_saved_and_compared(options, masks, tmp_path):
    memory = st.contour.ShapeMemory(**options)
    for mask in masks:
        memory.learn(mask)
    memory.save(tmp_path / "a.memory")
    assert st.contour.ShapeMemory.load(tmp_path / "a.memory") == memory
    assert pickle.loads(pickle.dumps(memory)) == memory


@pytest.mark.parametrize(
    "options",
    [
        {"init_D": [np.float32(1), np.float32(2)]},
        {"init_D": [np.array([1.0, 0]), np.array([0, 1.0])]},
        {"n_in": np.int64(2), "threads": np.int32(1), "norm_in": (np.float32(2), 1)},
    ],
)
def test_a_model_made_with_numpys_numbers_is_saved_and_compared(options, tmp_path):
    model = st.LWPR(**options).update(np.random.default_rng(0).random((30, 2)), np.arange(30.0))
    model.save(tmp_path / "a.lwpr")
    assert st.LWPR.load(tmp_path / "a.lwpr") == model
