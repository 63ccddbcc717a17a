# SPDX-License-Identifier: MIT
"""Regression by local models: against its plain twin, against differences, against functions that are known."""

import threading

import numpy as np
import pytest
from gpu_marks import on_gpu

import sdftrack as st
from experiments.synth.functions import surface_data
from reference import lwpr as plain
from sdftrack.contour import lwpr_data

# Sums run in another order in the core, some 600 samples long; the traces forget what they differ by.
TWIN_RTOL = 1e-9
# Central differences in double: a third of the digits.
DIFFERENCE_RTOL = 1e-5
# nMSE of a line after 50,000 samples. Traces that go on turning with their directions are not a least squares
# solution: more than one projection comes near it, not to the last digit.
LINE_NMSE = {1: 1e-9, 2: 1e-4, 4: 3e-4}
LINE_SLOPE_ATOL = 0.03  # for the same reason; the steepest slope is 1.5


def samples(n, count, seed=0, noise=0.1):
    """Inputs (count, n) and a function of them with a bend in every direction, (count,), with noise."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-1, 1, (count, n))
    return x, np.sin(3 * x[:, 0]) + 0.5 * np.prod(np.cos(x), axis=1) + rng.normal(0, noise, count)


# Against the twin
@pytest.mark.parametrize(
    ("n", "diagonal", "meta"),
    [(1, False, False), (2, False, False), (2, False, True), (2, True, True), (3, False, False), (5, False, True),
     (5, True, False)],
)  # fmt: skip
def test_the_core_learns_what_the_twin_learns(n, diagonal, meta):
    options = {
        "diagonal": diagonal, "meta": meta, "w_prune": 0.6, "add_threshold": 0.95, "init_alpha": 20.0,
        "penalty": 1e-4, "w_cutoff": 0.001,
    }  # fmt: skip
    x, y = samples(n, 400 if n < 3 else 250)
    twin = plain.Unit(n, plain.Options(init_D=8 * np.eye(n), **options))
    for xi, yi in zip(x, y, strict=True):
        twin.update(xi, yi)
    model = st.LWPR(init_D=8, **options).update(x, y)
    assert model.n_fields == (len(twin.fields),)
    for ours, theirs in zip(model.fields, twin.fields, strict=True):
        np.testing.assert_allclose(ours.D, theirs.M.T @ theirs.M, rtol=TWIN_RTOL, atol=TWIN_RTOL)
        assert (ours.n_projections, ours.n_trusted) == (theirs.R, theirs.trusted)
        assert ours.n_data == theirs.n_data
    places = np.random.default_rng(1).uniform(-1.2, 1.2, (60, n))
    expected = np.array([twin.predict(p) for p in places])
    mean, sd = model.predict(places, confidence=True)
    np.testing.assert_allclose(mean, expected[:, 0], rtol=TWIN_RTOL, atol=TWIN_RTOL)
    np.testing.assert_allclose(sd, expected[:, 1], rtol=TWIN_RTOL, atol=TWIN_RTOL)
    np.testing.assert_allclose(model.predict(places), mean, rtol=TWIN_RTOL, atol=TWIN_RTOL)


def test_the_activation_is_that_of_the_nearest_field():
    x, y = samples(2, 300)
    model = st.LWPR(init_D=20).update(x, y)
    places = np.random.default_rng(1).uniform(-2, 2, (50, 2))
    d = places[:, None] - np.array([f.center for f in model.fields])
    D = np.array([f.D for f in model.fields])
    w = np.exp(-0.5 * np.einsum("nki,kij,nkj->nk", d, D, d)).max(axis=1)
    expected = np.where(w > lwpr_data.GIVEN["w_cutoff"], w, 0)
    np.testing.assert_allclose(model.activations(places)[:, 0], expected, rtol=TWIN_RTOL)
    assert model.activations(places[0]).shape == (1,)


# Against differences
def leave_one_out_cost(x, y, w):
    """J1 of eq. 6.14 by doing it: a weighted regression for each sample, without it. s are columns of x."""
    total = 0.0
    for i in range(len(x)):
        keep = np.arange(len(x)) != i
        A = (w[keep, None] * x[keep]).T @ x[keep]
        b = (w[keep, None] * x[keep]).T @ y[keep]
        total += w[i] * (y[i] - x[i] @ np.linalg.solve(A, b)) ** 2
    return total / w.sum()


def orthogonal_samples(seed=3, count=30):
    """Inputs whose weighted columns are orthogonal, as the projections of partial least squares are."""
    rng = np.random.default_rng(seed)
    w = rng.uniform(0.2, 1, count)
    x = np.linalg.qr(rng.normal(size=(count, 3)))[0] / np.sqrt(w)[:, None]
    return 4 * x, rng.normal(size=count), w


def test_the_slope_of_the_leave_one_out_cost_is_that_of_leaving_one_out():
    x, y, w = orthogonal_samples()
    P = np.linalg.inv((w[:, None] * x).T @ x)
    e = y - x @ (P @ (w * y @ x))
    h = w * np.einsum("ni,ij,nj->n", x, P, x)
    e_cv = e / (1 - h)
    E, W = float(w @ e_cv**2), float(w.sum())
    H = (w * e_cv / (1 - h)) @ x
    R = ((w**2 * e_cv**2 / (1 - h))[:, None] * x).T @ x
    for k in range(0, len(w), 5):
        slope = plain.loo_slope(e[k], h[k], P @ x[k], E, W, H, R)
        up, down = w.copy(), w.copy()
        up[k] += 1e-5
        down[k] -= 1e-5
        difference = (leave_one_out_cost(x, y, up) - leave_one_out_cost(x, y, down)) / 2e-5
        assert slope == pytest.approx(difference, rel=DIFFERENCE_RTOL, abs=1e-9)


@pytest.mark.parametrize("penalty", [0.0, 0.01])
def test_the_gradient_of_the_metric_is_the_slope_of_the_penalised_cost(penalty):
    rng = np.random.default_rng(5)
    M, d, slope, W = np.triu(rng.normal(size=(3, 3))) + 3 * np.eye(3), rng.normal(0, 0.2, 3), 0.7, 5.0

    def weight(M):
        return float(np.exp(-0.5 * np.sum((M @ d) ** 2)))

    w = weight(M)
    gradient = plain.metric_gradient(M, d, w, slope, penalty, W)

    def cost(M):  # a cost with this slope by w, and a sample's share of the penalty
        return slope * weight(M) + w / W * penalty / 3 * np.sum((M.T @ M) ** 2)

    for i in range(3):
        for j in range(i, 3):
            step = np.zeros((3, 3))
            step[i, j] = 1e-6
            difference = (cost(M + step) - cost(M - step)) / 2e-6
            assert gradient[i, j] == pytest.approx(difference, rel=DIFFERENCE_RTOL, abs=1e-9)


# Against what is known
@pytest.mark.parametrize("n", [1, 2, 4])
def test_one_field_with_as_many_projections_as_inputs_learns_a_line(n):
    x = np.random.default_rng(0).uniform(-1, 1, (50_000, n))
    slope = np.arange(1, n + 1) - 2.5
    y = x @ slope + 0.5
    model = st.LWPR(init_D=0.01, add_threshold=1.0, init_lambda=0.99, update_D=False).update(x, y)
    (field,) = model.fields
    assert field.n_projections == n
    np.testing.assert_allclose(field.slope, slope, atol=LINE_SLOPE_ATOL)
    assert np.mean((model.predict(x[:1000]) - y[:1000]) ** 2) < LINE_NMSE[n] * y.var()


def test_the_training_error_is_the_noise_that_is_left():
    x = np.random.default_rng(0).uniform(-1, 1, (8000, 2))
    y = x @ [1.0, -2.0] + np.random.default_rng(1).normal(0, 0.2, len(x))
    assert st.LWPR(init_D=0.01).update(x, y).training_error[0] == pytest.approx(0.2, rel=0.05)


def test_a_learnt_metric_follows_the_bend_of_the_function():
    """Along x0 the function bends, along x1 it does not: the fields become narrow along x0."""
    x = np.random.default_rng(0).uniform(-1, 1, (20_000, 2))
    y = np.sin(3 * x[:, 0]) + np.random.default_rng(1).normal(0, 0.05, len(x))
    learnt = st.LWPR(init_D=10, init_alpha=20.0).update(x, y)
    fixed = st.LWPR(init_D=10, update_D=False).update(x, y)
    D = np.mean([f.D for f in learnt.fields if abs(f.center).max() < 0.8], axis=0)
    assert D[0, 0] > 2 * D[1, 1]
    error = [np.mean((m.predict(x) - np.sin(3 * x[:, 0])) ** 2) for m in (learnt, fixed)]
    assert error[0] < 0.5 * error[1]


def test_far_from_all_data_the_mean_of_the_outputs_is_said_with_an_infinite_deviation():
    x, y = samples(2, 200)
    model = st.LWPR().update(x, y)
    mean, sd = model.predict([50.0, 50.0], confidence=True)
    assert (mean, sd) == (pytest.approx(y.mean()), np.inf)
    assert model.activations([50.0, 50.0]) == [0]


def test_a_young_field_says_its_mean():
    model = st.LWPR().update([0.0, 0.0], 3.0)
    assert model.predict([0.1, 0.0]) == pytest.approx(3.0)
    assert model.predict([0.1, 0.0], return_std=True)[1] == np.inf


def test_scales_of_inputs_and_outputs_do_not_matter_when_given():
    x, y = samples(2, 800)
    scale = np.array([1000.0, 0.01])
    one = st.LWPR(init_D=10).update(x, y)
    two = st.LWPR(init_D=10, norm_in=scale, norm_out=50.0).update(x * scale, y * 50)
    np.testing.assert_allclose(two.predict(x * scale), 50 * one.predict(x), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(two.fields[0].center, one.fields[0].center * scale, rtol=1e-9)
    np.testing.assert_allclose(two.fields[0].D * np.outer(scale, scale), one.fields[0].D, rtol=1e-6)
    auto = st.LWPR(init_D=10, norm_in="auto").update(x * scale, y)
    reference = st.LWPR(init_D=10, norm_in=(x * scale).std(axis=0)).update(x * scale, y)
    np.testing.assert_array_equal(auto.predict(x * scale), reference.predict(x * scale))


# Threads, batches, the search
@pytest.mark.parametrize("options", [{}, {"diagonal": True, "meta": True}])
def test_neither_threads_nor_the_size_of_a_batch_change_a_bit(options):
    x, y = surface_data(0, 1500)
    one = st.LWPR(init_D=20, threads=1, **options).update(x, y)
    many = st.LWPR(init_D=20, threads=4, **options)
    for first in range(0, len(x), 77):
        many.update(x[first : first + 77], y[first : first + 77])
    single = st.LWPR(init_D=20, threads=1, **options)
    for xi, yi in zip(x[:300], y[:300], strict=True):
        single.update(xi, yi)
    first = st.LWPR(init_D=20, threads=3, **options).update(x[:300], y[:300])
    for a, b in ((one, many), (single, first)):
        for p, q in zip(a.predict(x, confidence=True), b.predict(x, confidence=True), strict=True):
            np.testing.assert_array_equal(p, q)
        np.testing.assert_array_equal(a.activations(x), b.activations(x))


@pytest.mark.parametrize("n", [1, 2, 4])
def test_the_search_leaves_out_no_field(n):
    """Hundreds of fields whose metrics move: the answers are those of a loop over all of them."""
    x, y = samples(n, 4000)
    model = st.LWPR(init_D={1: 40_000, 2: 400, 4: 20}[n], init_alpha=2000.0, w_cutoff=0.02).update(x, y)
    assert model.n_fields[0] > 100
    places = np.random.default_rng(1).uniform(-1.3, 1.3, (200, n))
    fields = model.fields
    center, D = np.array([f.center for f in fields]), np.array([f.D for f in fields])
    d = places[:, None] - center
    w = np.exp(-0.5 * np.einsum("nki,kij,nkj->nk", d, D, d))
    said = np.array([f.value for f in fields]) + np.einsum("nki,ki->nk", d, [f.slope for f in fields])
    w = np.where((w > 0.02) & [f.trustworthy for f in fields], w, 0)
    known = w.sum(axis=1) > 0
    expected = np.sum(w * said, axis=1)[known] / w.sum(axis=1)[known]
    np.testing.assert_allclose(model.predict(places)[known], expected, rtol=1e-7, atol=1e-7)


def test_an_update_beside_anything_else_is_refused_and_nothing_is_damaged():
    x, y = samples(2, 60_000)
    model = st.LWPR(init_D=300, threads=1).update(x[:100], y[:100])
    worker = threading.Thread(target=model.update, args=(x, y))
    refused = 0
    worker.start()
    while worker.is_alive():
        try:
            model.update(x[:1], y[:1])
        except RuntimeError as error:
            assert "in use by another thread" in str(error)  # noqa: PT017
            refused += 1
            break
    worker.join()
    assert refused
    assert model.n_samples >= len(x) + 100
    assert np.isfinite(model.predict(x[:1000])).all()


@on_gpu
def test_the_gpu_predicts_what_the_cpu_does():
    x, y = surface_data(0, 3000)
    model = st.LWPR(init_D=20, diagonal=True).update(x, y)
    places = np.concatenate([x, 40 + x[:5]])
    cpu, gpu = model.predict(places), model.predict(places, device="cuda")
    np.testing.assert_array_equal(gpu, cpu)
