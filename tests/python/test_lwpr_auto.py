# SPDX-License-Identifier: MIT
"""LWPR without settings: what follows from the first samples."""

import pickle
import warnings

import numpy as np
import pytest

import sdftrack as st
from experiments.lwpr.functions import CHOSEN_ON, REPORTED_ON
from sdftrack.contour import lwpr_data


def drawn(name, seed=50, count=None):
    case = {**REPORTED_ON, **CHOSEN_ON}[name]
    rng = np.random.default_rng(seed)
    x = case.places(rng, count or case.samples)
    y = case.value(x)
    ask = case.places(rng, 1500)
    return x, y + rng.normal(0, case.noise, y.shape), ask, case.value(ask), case.target


@pytest.mark.parametrize("name", [name for name in REPORTED_ON if "cross" not in name])
def test_known_functions_are_learnt_without_a_setting(name):
    x, y, ask, truth, target = drawn(name)
    model = st.LWPR().update(x, y)
    mean, sd = model.predict(ask, confidence=True)
    assert np.mean(((mean - truth) ** 2).mean(axis=0) / truth.var(axis=0)) < 1.1 * target
    assert np.mean(np.abs(mean - truth) < 1.96 * sd) > 0.94
    assert max(model.n_fields) < len(x) / 4


def test_the_cross_is_learnt_without_a_setting():
    x, y, ask, truth, target = drawn("cross, 2 inputs")
    assert np.mean((st.LWPR().update(x, y).predict(ask) - truth) ** 2) < target * truth.var()


def test_units_of_inputs_do_not_matter():
    x, y, ask, _, _ = drawn("Friedman 3, 4 inputs", count=800)
    scale = np.array([1e-3, 1e4, 1.0, 7.0])
    one, two = st.LWPR().update(x, y), st.LWPR().update(x * scale + 5, y)
    np.testing.assert_allclose(two.predict(ask * scale + 5), one.predict(ask), rtol=1e-6)


def test_the_metric_covers_the_wanted_part_of_the_samples():
    x = np.random.default_rng(0).normal(size=(250, 3))
    D = lwpr_data.metric(x, 0.03)
    i, j = np.triu_indices(len(x), 1)
    assert np.exp(-0.5 * D * ((x[i] - x[j]) ** 2).sum(axis=1)).mean() == pytest.approx(0.03, rel=0.02)


@pytest.mark.parametrize("x", [np.ones((40, 2)), np.zeros((1, 2)), [[1e200, 0.0], [-1e200, 1.0], [0.0, 2.0]]])
def test_samples_that_say_nothing_of_a_scale_give_a_model_or_one_clear_error(x):
    try:
        model = st.LWPR().update(x, np.arange(len(x)))
    except ValueError as error:
        assert str(error).startswith("x: expected finite numbers")  # noqa: PT017
    else:
        assert np.isfinite(model.predict(x)).all()


# Samples that come one after another
@pytest.mark.parametrize("call", [1, 7, 100])
def test_samples_one_by_one_give_the_bits_of_one_call(call):
    """The cross is learnt to the same error; settings follow from the samples, not from the sizes of the calls."""
    x, y, ask, truth, _ = drawn("cross, 2 inputs", count=20_000)
    stream, at_once = st.LWPR(), st.LWPR().update(x, y)
    for i in range(0, len(x), call):
        stream.update(*((x[i], y[i]) if call == 1 else (x[i : i + call], y[i : i + call])))
    assert stream == at_once
    np.testing.assert_array_equal(stream.predict(ask), at_once.predict(ask))
    assert np.mean((stream.predict(ask) - truth) ** 2) < 0.015 * truth.var()


def test_settings_stay_from_the_last_of_the_first_samples_on(monkeypatch):
    monkeypatch.setattr(lwpr_data, "FIRST", 256)
    monkeypatch.setattr(st.contour.lwpr, "FIRST", 256)
    x, y, ask, _, _ = drawn("peaks, 2 inputs", count=700)
    stream = st.LWPR()
    for xi, yi in zip(x, y, strict=True):
        stream.update(xi, yi)
    batch = st.LWPR().update(x[:256], y[:256]).update(x[256:], y[256:])
    assert stream == batch
    assert "first" not in stream.__getstate__()
    np.testing.assert_array_equal(stream.predict(ask), batch.predict(ask))


@pytest.mark.parametrize("count", [1, 5, 255, 256, 257])
def test_a_model_that_has_not_settled_goes_on_after_saving_and_copying(count, tmp_path):
    x, y, ask, _, _ = drawn("peaks, 2 inputs", count=count + 300)
    model = st.LWPR().update(x[:count], y[:count])
    model.save(tmp_path / "model.lwpr")
    others = [st.LWPR.load(tmp_path / "model.lwpr"), pickle.loads(pickle.dumps(model)), model.copy()]
    model.update(x[count:], y[count:])
    for other in others:
        assert other != model
        other.update(x[count:], y[count:])
        assert other == model
        np.testing.assert_array_equal(other.predict(ask), model.predict(ask))


# Words
def test_as_many_fields_as_samples_are_warned_of_once_in_a_doubling():
    x, y, _, _, _ = drawn("Friedman 1, 10 inputs", count=600)
    model = st.LWPR(init_D=2500.0)
    with pytest.warns(
        UserWarning, match=r"LWPR: 600 receptive fields for 600 samples.*smaller init_D"
    ) as seen:
        model.update(x, y)
    assert len(seen) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.update(x[:10], y[:10])
        st.LWPR().update(x, y)
