# SPDX-License-Identifier: MIT
"""Results compare, copy and pickle, whatever arrays they hold."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

from sdftrack.calibration.color_result import ColorCalibration
from sdftrack.calibration.intrinsics_result import IntrinsicsResult, PerFrame
from sdftrack.calibration.observability import Observability
from sdftrack.calibration.pairs import BallPairs, ColorMapping
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.reconstruction.quality import Quality
from sdftrack.superpixels.regions import Regions

RECORDS = [PerFrame, IntrinsicsResult, ColorCalibration, Observability, BallPairs, ColorMapping]
RECORDS += [PrimitiveFit, Quality, Regions]


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
