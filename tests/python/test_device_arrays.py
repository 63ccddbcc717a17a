# SPDX-License-Identifier: MIT
"""Arrays that lie on a GPU go in and come out without a copy."""

import numpy as np
import pytest
from gpu_marks import MARKS

import sdftrack as st
from sdftrack import _core

pytestmark = MARKS


def there(array):
    return _core.DeviceArray.of(array, _core.cuda_devices()[0])


def picture():
    y, x = np.mgrid[:60, :90]
    return np.stack([2 * y, x, (x * y) % 97], axis=-1).astype(np.uint8)


def learnt():
    x = np.random.default_rng(0).uniform(-1, 1, (1000, 2))
    model = st.LWPR(2, 2)
    model.update(x, np.stack([np.sin(3 * x[:, 0]), x[:, 1] ** 2], axis=-1))
    return model


@pytest.mark.parametrize("image", [picture(), picture()[..., 0].copy()], ids=["color", "grey"])
def test_labels_of_an_image_on_the_gpu_stay_there(image):
    labels = st.superpixels.slic(there(image), n_segments=40, device="cuda")
    assert isinstance(labels, _core.DeviceArray)
    assert labels.shape == image.shape[:2]
    np.testing.assert_array_equal(labels, st.superpixels.slic(image, n_segments=40, device="cpu"))


def test_predictions_on_the_gpu_stay_there_also_where_no_field_is_active():
    model = learnt()
    x = np.random.default_rng(1).uniform(-1, 1, (500, 2))
    x[7] = 50
    said = model.predict(there(x), device="cuda")
    assert isinstance(said, _core.DeviceArray)
    np.testing.assert_array_equal(said, model.predict(x, device="cpu"))


def test_a_nan_on_the_gpu_is_refused_as_one_of_the_host_is():
    x = np.zeros((9, 2))
    x[4, 1] = np.nan
    with pytest.raises(ValueError, match="NaN in sample 4"):
        learnt().predict(there(x), device="cuda")


def test_an_array_of_another_type_is_copied():
    model = learnt()
    x = np.random.default_rng(1).uniform(-1, 1, (50, 2)).astype(np.float32)
    said = model.predict(there(x), device="cuda")
    assert isinstance(said, np.ndarray)
    np.testing.assert_array_equal(said, model.predict(x, device="cpu"))


def test_an_array_says_where_it_lies_and_of_what_it_is():
    array = there(np.arange(6, dtype=np.float32).reshape(2, 3))
    assert (array.shape, array.dtype, len(array)) == ((2, 3), np.float32, 2)
    assert array.device == f"cuda:{_core.cuda_devices()[0]}"
    assert array.__dlpack_device__() == (2, _core.cuda_devices()[0])
    assert array.__cuda_array_interface__["shape"] == (2, 3)
    np.testing.assert_array_equal(array.host(), [[0, 1, 2], [3, 4, 5]])
    with pytest.raises(ValueError, match="stream"):
        array.__dlpack__(stream=0)


def test_a_capsule_is_used_once():
    capsule = there(np.zeros(3)).__dlpack__()
    assert _core.BorrowedArray(capsule).shape == (3,)
    with pytest.raises(TypeError, match="unused DLPack capsule"):
        _core.BorrowedArray(capsule)


@pytest.mark.parametrize("library", ["torch", "cupy", "jax"])
def test_other_libraries_take_and_give_arrays_without_a_copy(library):
    pytest.importorskip(library)
    image = picture()
    if library == "torch":
        import torch

        given = torch.from_numpy(image).cuda()
        take = torch.from_dlpack
    elif library == "cupy":
        import cupy

        given = cupy.asarray(image)
        take = cupy.from_dlpack
    else:
        import jax

        given = jax.device_put(image, jax.devices("gpu")[0])
        take = jax.dlpack.from_dlpack
    labels = st.superpixels.slic(given, n_segments=40, device="cuda")
    assert isinstance(labels, _core.DeviceArray)
    taken = take(labels)
    host = taken.get() if library == "cupy" else np.asarray(taken.cpu() if library == "torch" else taken)
    np.testing.assert_array_equal(host, st.superpixels.slic(image, n_segments=40, device="cpu"))
