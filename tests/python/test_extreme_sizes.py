# SPDX-License-Identifier: MIT
"""Sizes and numbers of things that a file or a caller of the core may give: those that no volume or model has."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack import _core
from sdftrack._internal import saved_file
from sdftrack.contour import lwpr_file


def lwpr_file_with(path, options, n_in, field):
    """A model file, both checksums right, that holds one output with one field of these numbers."""
    core = _core.LwprModel(n_in, 1, options, [1.0] * n_in, [1.0]).to_bytes()
    words = np.frombuffer(core[:-8], np.uint64)
    numbers = words[3:].view(np.float64)[:-3]  # up to the one output, which has no field
    numbers = np.concatenate([numbers, [1.0, 1.0, 0.0], field])
    words = np.concatenate([words[:2], np.array([len(numbers)], np.uint64), numbers.view(np.uint64)])
    total, most = 0xCBF29CE484222325, (1 << 64) - 1
    for word in words.tolist():
        total = (total ^ word) * 0x100000001B3 & most
        total ^= total >> 32
    model = st.LWPR(n_in, 1, diagonal=options.diagonal)
    state = {**model.__getstate__(), "core": words.tobytes() + total.to_bytes(8, "little")}
    saved_file.write(path, lwpr_file.KIND, lwpr_file.content_of(state))


@pytest.mark.parametrize(
    ("n_in", "projections", "trusted"),
    [(100_000, 6000, 6000), (100_000, 5369, 0), (50, 40, 51), (50, 1.5, 1), (50, np.nan, 0), (50, 2, 1.5)],
)
def test_a_model_file_that_promises_more_than_it_holds_is_refused(tmp_path, n_in, projections, trusted):
    options = _core.LwprOptions()
    options.diagonal = True
    head = np.zeros(12)
    head[4:6] = projections, trusted
    lwpr_file_with(tmp_path / "m.lwpr", options, n_in, np.concatenate([np.ones(2 * n_in), head]))
    with pytest.raises(ValueError, match="inconsistent fields"):
        st.LWPR.load(tmp_path / "m.lwpr")


def test_a_field_that_the_model_does_not_have_is_refused():
    core = _core.LwprModel(2, 1, _core.LwprOptions(), [1.0, 1.0], [1.0])
    for output in (7, -1, 2**31 - 1):
        with pytest.raises(ValueError, match=r"output: expected 0\.\.0"):
            core.fields(output)
