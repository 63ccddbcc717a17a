# SPDX-License-Identifier: MIT
"""Results of the contour tracker and of the shape memory as records: equal, short, drawn, kept; options in files."""

import copy
import pickle

import numpy as np
import pytest

import sdftrack as st
from experiments.synth.blob import blob_video
from experiments.synth.gait import gait


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
