# SPDX-License-Identifier: MIT
"""Results compare, copy and pickle, whatever arrays they hold."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

import sdftrack as st
from experiments.synth.gait import gait
from sdftrack.calibration.color_result import BallPairs, ColorCalibration, ColorMapping
from sdftrack.calibration.intrinsics_result import IntrinsicsResult, Observability, PerFrame
from sdftrack.contour.result import Assessment, ContourResult
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.reconstruction.quality import Quality
from sdftrack.superpixels.regions import Regions

RECORDS = [PerFrame, IntrinsicsResult, ColorCalibration, Observability, BallPairs, ColorMapping]
RECORDS += [PrimitiveFit, Quality, Regions, ContourResult, Assessment]


def filled(record, changed=None):
    """One with an array of its own in every field, in a list in every third, NaN among the numbers."""
    values = {}
    for i, field in enumerate(dataclasses.fields(record)):
        array = np.array([[i, np.nan], [2.0, 3.0]]) + (field.name == changed)
        values[field.name] = {"a": [array, i]} if i % 3 == 0 else array
    return record(**values)


@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r.__name__)
def test_a_result_equals_its_copies_and_nothing_else(record):
    a = filled(record)
    for b in (filled(record), copy.deepcopy(a), copy.copy(a), pickle.loads(pickle.dumps(a))):
        assert a == b
    for field in dataclasses.fields(record):
        assert a != filled(record, field.name), field.name
    assert a != "something else"


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda r: pickle.loads(pickle.dumps(r))])
def test_neither_a_result_nor_its_copy_can_be_written(again):
    image = np.zeros((60, 80, 3), np.uint8)
    image[20:40, 30:50] = 200
    result = st.contour.ContourTracker().start(image, mask=image[..., 0] > 0)
    for one in (result, again(result)):
        with pytest.raises(ValueError, match="read-only"):
            one.mask[0, 0] = True


NUMPYS = [
    {"n_harmonics": np.int64(8)},
    {"n_inputs": np.int32(2), "spacing": np.float32(0.02)},
    {"capacity": np.uint8(40), "w_gen": np.float16(0.25)},
    {"rule": "printed", "lwpr": {"init_D": np.array(3.0), "penalty": np.float32(1e-4)}},
]


@pytest.mark.parametrize("options", NUMPYS)
def test_a_memory_made_with_numpys_numbers_is_saved_and_compared(options, tmp_path):
    memory = st.contour.ShapeMemory(**options)
    for mask in gait("cat", 24):
        memory.learn(mask)
    memory.save(tmp_path / "a.memory")
    assert st.contour.ShapeMemory.load(tmp_path / "a.memory") == memory
    assert pickle.loads(pickle.dumps(memory)) == memory
