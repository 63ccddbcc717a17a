# SPDX-License-Identifier: MIT
"""Regression by local models: files, copies, wrong input, and what scikit-learn's tools ask for."""

import functools

import numpy as np
import pytest
from measured_memory import peak_bytes
from refusals import assert_refused, refused

import sdftrack as st


def data(count=400, n_out=1):
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (count, 2))
    y = np.stack([np.sin(3 * x[:, 0]) + (k + 1) * x[:, 1] for k in range(n_out)], axis=1)
    return x, y


@pytest.fixture
def model():
    return st.LWPR(init_D=[30, 20], norm_in="auto", meta=True).update(*data(n_out=2))


def as_saved(model, tmp_path):
    model.save(tmp_path / "model.lwpr")
    return st.LWPR.load(tmp_path / "model.lwpr")


# Files and copies
def test_a_model_without_data_can_be_saved(tmp_path):
    empty = st.LWPR(2, w_gen=0.3)
    other = as_saved(empty, tmp_path)
    assert other == empty
    assert repr(other) == "LWPR(n_in=2, n_out=None, nothing learned)"


def test_the_core_refuses_bytes_that_are_no_model(model):
    state = model.__getstate__()
    core = state["core"]
    for bad in (core[:-8], core[8:], core + b"12345678", b"x" * 100, core[:24]):
        state["core"] = bad
        with pytest.raises(ValueError, match=r"expected a model written by LWPR\.save"):
            model.copy().__setstate__(state)


# Wrong input
def metric(init_D, diagonal=False):
    return st.LWPR(init_D=init_D, diagonal=diagonal).update([0.0, 0.0], 1.0)


def fed(x, y, **options):
    return st.LWPR(**options).update(x, y)


def scored(*arguments):
    return st.LWPR().fit(np.random.default_rng(0).random((20, 2)), np.zeros(20)).score(*arguments)


NOTHING = "nothing has been learned yet"
EMPTY = np.zeros((0, 2))


@refused(
    *((functools.partial(metric, D), ValueError, "^init_D: expected")
      for D in (-1, [1, -1], [1, 2, 3], [[1, 2], [2, 1]], [[1, 2], [0, 1]], [np.inf, 1])),
    (lambda: metric([[1, 0.5], [0.5, 1]], diagonal=True), ValueError, "^init_D: expected"),
    (lambda: fed(np.zeros(5), np.zeros(5), n_in=1), ValueError, r"use x\[:, None\]"),
    (lambda: st.LWPR(2).predict([0.0, 0.0]), ValueError, NOTHING + "; call update or fit"),
    (lambda: st.LWPR(2).activations([0.0, 0.0]), ValueError, NOTHING + "; call update or fit"),
    (lambda: st.LWPR().training_error, ValueError, NOTHING),
    (lambda: fed(np.zeros((2, 1001)), [0.0, 1.0], init_D=25.0), ValueError,
     r"n_in: expected at most 1000 with a full metric.*diagonal=True"),
    (lambda: fed([0.0, 0.0], 1.0, init_D=25.0, norm_in="auto"), ValueError,
     r'norm_in: "auto".*at least 2 samples, got 1'),
    *((functools.partial(fed, [[bad, 1.0]], [1.0], norm_in=1e300, norm_out=1e300), ValueError, "x: expected finite")
      for bad in (np.inf, -np.inf, np.nan)),
    *((functools.partial(fed, [[0.0, 1.0]], [bad], norm_in=1e300, norm_out=1e300), ValueError, "y: expected finite")
      for bad in (np.inf, -np.inf, np.nan)),
    (lambda: fed(np.ma.masked_array(np.zeros((3, 2)), mask=[[0, 0], [1, 0], [0, 0]]), np.zeros(3)), ValueError,
     "x: expected no masked values, got 1; omit their samples"),
    (lambda: fed(np.zeros((3, 2)), np.ma.masked_array(np.zeros(3), mask=[1, 0, 0])), ValueError,
     "y: expected no masked values"),
    (lambda: scored(EMPTY, np.zeros(0)), ValueError, "X: expected at least one sample"),
    *((functools.partial(scored, np.zeros((2, 2)), np.zeros(2), w), ValueError, "sample_weight: expected finite")
      for w in ([np.nan, 1], [0, 0], [-1, 2])),
    (lambda: scored(np.zeros((2, 2)), [np.nan, 0]), ValueError, "y: expected finite"),
)  # fmt: skip
def test_it_is_refused_by_name(call, error, words):
    assert_refused(call, error, words)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e30])
@pytest.mark.parametrize("where", ["x", "y"])
def test_a_sample_that_is_not_finite_is_refused_and_changes_nothing(model, bad, where):
    before = model.copy()
    x, y = data(50, n_out=2)
    (x if where == "x" else y)[30, 1] = bad
    with pytest.raises(
        ValueError, match=f"^{where}: expected finite numbers.*sample 30.*the model is unchanged"
    ):
        model.update(x, y)
    assert model == before
    if not np.isfinite(bad):  # its standard deviation would be none
        with pytest.raises(ValueError, match=f"^{where}: expected finite"):
            st.LWPR(norm_in="auto", norm_out="auto").update(x, y)
    if where == "x":
        for ask in (model.predict, model.activations):
            with pytest.raises(ValueError, match=r"^x: expected finite"):
                ask(x)


def test_large_numbers_that_are_allowed_leave_a_model_that_works():
    x, y = data(300)
    model = st.LWPR(init_D=20, meta=True).update(x, 1e24 * y).update(x, y).update(1e24 * x, y)
    assert np.isfinite(model.predict(x)).all()
    assert all(np.isfinite(f.D).all() and np.isfinite(f.slope).all() for f in model.fields)


# Shapes that come back
def test_predictions_have_the_shape_of_the_outputs():
    x, y = data(n_out=1)
    flat, column = st.LWPR().update(x, y[:, 0]), st.LWPR().update(x, y)
    assert isinstance(flat.predict(x[0]), float)
    assert flat.predict(x).shape == (400,)
    assert column.predict(x[0]).shape == (1,)
    assert column.predict(x).shape == (400, 1)
    one = st.LWPR().update(x[0], float(y[0, 0]))
    assert isinstance(one.predict(x[0]), float)
    assert st.LWPR().update(x[0], y[0]).predict(x[0]).shape == (1,)
    mean, sd = column.predict(x[0], return_std=True)
    assert mean.shape == sd.shape == (1,)


def test_fields_are_records_that_cannot_be_written(model):
    field = model.fields[-1]
    assert field.output == 1
    assert len(model.fields) == sum(model.n_fields)
    assert field.D.shape == (2, 2)
    assert "LWPRField(output=1" in repr(field)
    with pytest.raises(AttributeError):
        field.value = 3.0
    with pytest.raises(ValueError, match="read-only"):
        field.center[0] = 1
    assert st.LWPR().fields == []


# scikit-learn's interface
def test_fit_begins_anew_and_partial_fit_goes_on():
    x, y = data()
    fitted = st.LWPR().update(x[:100], y[:100]).fit(x, y)
    assert fitted == st.LWPR().update(x, y)
    assert st.LWPR().partial_fit(x[:100], y[:100]).partial_fit(x[100:], y[100:]) == fitted
    assert fitted.n_features_in_ == 2
    before = fitted.copy()
    with pytest.raises(ValueError, match="expected"):
        fitted.fit(x, y[:3])
    assert fitted == before


def test_score_is_r_squared():
    x, y = data(2000)
    model = st.LWPR(init_D=20).fit(x, y)
    r2 = 1 - np.sum((y - model.predict(x)) ** 2) / np.sum((y - y.mean()) ** 2)
    assert model.score(x, y) == pytest.approx(r2)
    assert model.score(x, y, sample_weight=np.ones(2000)) == pytest.approx(r2)
    with pytest.raises(ValueError, match=r"^y: expected"):
        model.score(x, y[:, 0])


def test_parameters_are_read_and_changed_by_name():
    model = st.LWPR(w_gen=0.3)
    assert model.get_params()["w_gen"] == 0.3
    assert model.set_params(w_gen=0.4, diagonal=True).w_gen == 0.4
    with pytest.raises(ValueError, match="unknown option 'w_ge'; did you mean 'w_gen'"):
        model.set_params(w_ge=0.1)
    with pytest.raises(ValueError, match="w_gen"):
        model.set_params(penalty=1.0, w_gen=3)
    assert (model.w_gen, model.penalty) == (0.4, st.LWPR().penalty)


# scikit-learn's own checks that do not hold, and why.
WORDS = "refused, in other words than scikit-learn's"
NOT_HELD = {
    "check_do_not_raise_errors_in_init_or_set_params": "wrong options are refused at once, not at the first fit",
    "check_fit2d_predict1d": "(n_in,) is one sample, by the documented interface",
    "check_dtype_object": "arrays of objects are not converted silently",
    "check_n_features_in_after_fitting": WORDS,
    "check_complex_data": WORDS,
    "check_estimators_empty_data_messages": WORDS,
    "check_estimator_sparse_tag": WORDS,
    "check_estimator_sparse_array": WORDS,
    "check_estimator_sparse_matrix": WORDS,
    "check_fit2d_1sample": WORDS,
    "check_requires_y_none": WORDS,
}


@pytest.mark.filterwarnings("ignore")  # it warns that the class is not derived from its own
def test_scikit_learns_own_checks_pass():
    pytest.importorskip("sklearn", reason="scikit-learn is not installed; it is not needed")
    from sklearn.utils.estimator_checks import check_estimator

    results = check_estimator(
        st.LWPR(norm_in="auto", threads=1), on_fail=None, expected_failed_checks=NOT_HELD
    )
    failed = {r["check_name"]: str(r["exception"])[:200] for r in results if r["status"] == "failed"}
    assert failed == {}


@pytest.mark.parametrize("y", [np.zeros(0), np.zeros((0, 2))])
def test_a_batch_without_samples_teaches_nothing(y):
    model = st.LWPR().update(np.zeros((0, 2)), y)
    with pytest.raises(ValueError, match="nothing has been learned"):
        model.predict([0.0, 0.0])
    model.update(np.zeros((3, 4)), np.zeros(3))  # the first data still say how many inputs there are
    assert model.n_inputs == 4
    before = model.copy()
    assert model.update(np.zeros((0, 4)), np.zeros(0)) == before
    assert model.predict(np.zeros((0, 4))).shape == (0,)


# A field of 100 inputs is 0.34 MB with its seven empty lanes, 0.05 MB in its record; scratch and first metric of each
# output by itself were 0.2 MB more.
MAX_MB_PER_OUTPUT = 0.48
BEFORE = """
import numpy as np, sdftrack as st
model, x = st.LWPR(threads=1), np.ones((1, 100))
st.LWPR().update(x, x[:, :1])
"""


def test_many_outputs_share_what_learning_needs():
    assert peak_bytes("model.update(x, np.ones((1, 300)))", BEFORE) / 300 < MAX_MB_PER_OUTPUT * 2**20
