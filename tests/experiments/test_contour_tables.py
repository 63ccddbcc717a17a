# SPDX-License-Identifier: MIT
"""The contour tracker on recorded sequences, and the tables of the shape memory."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.optimize import check_grad

from experiments.contour.breakdancer import breakdancer, tumbling
from experiments.contour.confidence import starts
from experiments.contour.contour import Davis, follow_davis, open_davis
from experiments.contour.gplvm import GPLVM, LatentSearch
from experiments.contour.opencv_ways import WAYS, follow_by, grabcut_in_box
from experiments.synth.gait import gait
from sdftrack.contour.dct import harmonics, series
from sdftrack.metrics import iou


@pytest.mark.parametrize(("sequence", "by", "least"), [("cows", "mask", 0.82), ("camel", "mask", 0.75)])
def test_recorded_animals_are_followed(data_dir, sequence, by, least):
    if not (data_dir / "davis" / sequence).is_dir():
        pytest.skip(f"recorded data absent: {data_dir / 'davis' / sequence}")
    video = open_davis(data_dir / "davis", sequence, most=40)
    assert follow_davis(video, by).ious.mean() > least


def test_opencv_starts_from_the_box_too():
    y, x = np.mgrid[:120, :160]
    mask = np.hypot(x - 80, y - 60) < 30
    noise = np.random.default_rng(0).normal(0, 8, (120, 160, 3))
    image = np.clip(np.where(mask[..., None], [170, 60, 60], [60, 120, 60]) + noise, 0, 255).astype(np.uint8)
    assert iou(grabcut_in_box(image, (50, 30, 61, 61)), mask) > 0.95


@pytest.mark.parametrize("way", list(WAYS))
def test_every_way_of_opencv_follows_a_spotted_disc_of_its_own_colour(way):
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:120, :160]
    spots = cv2.GaussianBlur(rng.normal(0, 60, (120, 160)), (0, 0), 2)
    images, truth = [], []
    for shift in range(0, 24, 3):
        mask = np.hypot(x - 60 - shift, y - 60) < 25
        colors = np.where(mask[..., None], [170, 60, 60], [60, 120, 60])
        texture = np.where(mask, np.roll(spots, shift, 1), 0)
        images.append(np.clip(colors + texture[..., None], 0, 255).astype(np.uint8))
        truth.append(mask)
    value, _ = follow_by(WAYS[way], images, truth[0], truth)
    stays = float(np.mean([iou(truth[0], true) for true in truth[1:]]))
    assert value > max(0.8, stays + 0.1)
    assert follow_by(WAYS[way], images, truth[0], truth)[0] == value  # no chance


def test_the_fit_starts_at_three_frames_in_both_directions():
    mask = np.ones((20, 20), bool)
    video = Davis("v", list(range(9)), [mask] * 9)
    firsts = [(images[0], images[1] - images[0], by) for images, _, by in starts(video, True)]
    expected = [(0, 1), (3, 1), (6, 1), (8, -1), (3, -1), (6, -1)]
    assert firsts == [(*start, by) for start in expected for by in ("mask", "box")]
    assert len(list(starts(video, False))) == 2
    video.masks[0] = ~mask  # nothing to start from
    assert len(list(starts(video, True))) == 10


def test_the_tables_are_printed_without_recorded_data(tmp_path, measured):
    tables = measured("shape_memory", "--frames", "30", data=tmp_path)["tables"]
    assert sum(row[0] == "walker" for table in tables for row in table["rows"]) == 7


def test_derivatives_of_the_latent_variable_model_are_those_of_its_costs():
    rng = np.random.default_rng(0)
    model = GPLVM(rng.normal(size=(12, 6)), q=2)
    there = np.append(model.X.ravel(), np.log([1.0, 0.8, 0.1])) + 0.1 * rng.normal(size=27)
    assert off(model._cost, there) < 1e-4  # of forward differences
    search = LatentSearch(model, rng.normal(size=(40, 6)))
    more_inside, outside = rng.uniform(-0.5, 0.5, 40), np.full(40, 0.6)
    assert (
        off(lambda x: search._cost(x, more_inside, outside), model.X[3] + 0.1) < 1e-4
    )  # of forward differences


def off(cost, there):
    """Difference of a derivative to finite differences over its length."""
    return check_grad(lambda x: cost(x)[0], lambda x: cost(x)[1], there) / np.linalg.norm(cost(there)[1])


@pytest.mark.slow
def test_the_latent_search_finds_a_training_shape_that_is_half_hidden():
    masks = gait("cat", 30)
    codes = np.array([harmonics(m, 10) for m in masks])
    pictures = np.array([series(unit, (64, 64), "max").ravel() for unit in np.eye(100)]).T
    search = LatentSearch(GPLVM(codes), pictures)
    seen = masks[12].copy()
    seen[:, :30] = False
    found = (pictures @ search.complete(seen) > 0).reshape(64, 64)
    # Ten harmonics of the whole mask overlap with it by 0.79, the observed half by 0.5.
    assert iou(found, masks[12]) > 0.7  # measured 0.75
    assert iou(seen, masks[12]) < 0.6


def test_breakdancers_and_tumbling_gaits_are_seeded_and_do_not_repeat():
    for make in (lambda seed: breakdancer(20, seed), lambda seed: tumbling(gait("hand", 20), seed)):
        masks = make(1)
        np.testing.assert_array_equal(masks, make(1))
        assert (masks != make(2)).any()
        assert max(iou(masks[0], m) for m in masks[10:]) < 0.9


@pytest.mark.slow
def test_an_answer_to_an_unknown_pose_is_hardly_ever_worse_than_none(tmp_path, measured):
    chosen, held_out, _ = measured("unknown_poses", "--frames", "48", "--seeds", "1", data=tmp_path)["tables"]
    worse = {row[0]: float(row[3]) for row in held_out["rows"]}
    assert worse["2"] < 0.5 * worse["any"]
    assert worse["2"] < 1.5
    assert [row[0] for row in chosen["rows"]][-1] == "any"
