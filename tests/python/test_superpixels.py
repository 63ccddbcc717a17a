# SPDX-License-Identifier: MIT
"""Superpixels: the core against its twin, colours against scikit-image, properties of connectivity, bad input."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs

import sdftrack as st
from experiments.superpixels.times import memory
from experiments.synth.region_picture import region_picture
from reference import superpixels as twin
from sdftrack import metrics
from sdftrack.cli.app import run

COLOR_ATOL = 0.02  # units of L, a, b: 1/128 from rounding to 1/64, the rest from float32 and 6-digit matrices


def picture(height=72, width=96, seed=3):
    """Smooth colours, two edges and some noise."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    image = np.stack([2 * x, 3 * y, x + y], axis=-1).astype(float)
    image[(x - 50) ** 2 + (y - 30) ** 2 < 400] = (220, 60, 30)
    image[:, 70:] += 60
    return np.clip(image + rng.normal(0, 6, image.shape), 0, 255).astype(np.uint8)


def pieces(labels, present):
    from scipy import ndimage

    return [ndimage.label(labels == k)[1] for k in present]


IMAGE = picture()
DEPTH = np.where(picture(seed=4)[..., 0] > 40, 1 + picture(seed=5)[..., 1] / 200, 0).astype(np.float32)
DISC = np.hypot(*(np.mgrid[:72, :96] - 40)) < 30


@pytest.mark.parametrize(
    "options",
    [
        {}, {"color_space": "xyz"}, {"color_space": "rgb"}, {"distance": "thesis"},
        {"distance": "thesis", "depth": DEPTH}, {"enforce_connectivity": False}, {"compactness": 0.3},
        {"compactness": 300.0}, {"compactness": 4000.0}, {"n_segments": 1}, {"n_segments": 2500},
        {"n_segments": 10**6}, {"max_num_iter": 1}, {"max_num_iter": 12}, {"mask": DISC},
        {"mask": DISC, "enforce_connectivity": False}, {"depth": DEPTH}, {"min_size_factor": 1.0},
    ],
    ids=str,
)  # fmt: skip
def test_the_core_gives_the_labels_of_the_plain_numpy_twin(options):
    image = IMAGE[::3, ::3].copy() if options.get("n_segments", 0) > 2000 else IMAGE
    options = {"n_segments": 40, **options}
    np.testing.assert_array_equal(st.superpixels.slic(image, **options), twin.slic(image, **options))


@pytest.mark.parametrize(
    "kind", ["grey", "float", "noise", "one row", "one column", "one pixel", "two by two"]
)
def test_other_images_give_the_labels_of_the_twin_too(kind):
    image = {
        "grey": IMAGE[..., 1].copy(), "float": (IMAGE / 255).astype(np.float32),
        "noise": np.random.default_rng(0).integers(0, 256, (37, 41, 3), dtype=np.uint8),
        "one row": IMAGE[:1], "one column": IMAGE[:, :1].copy(), "one pixel": IMAGE[:1, :1].copy(),
        "two by two": IMAGE[:2, :2].copy(),
    }[kind]  # fmt: skip
    np.testing.assert_array_equal(st.superpixels.slic(image, 12), twin.slic(image, 12))


@pytest.mark.parametrize(
    ("height", "width", "segments"),
    [(9, 63, 20), (9, 64, 20), (9, 65, 20), (5, 129, 12), (128, 160, 2), (2, 8300, 1), (90, 7, 40)],
    ids=["below a word", "a word", "above a word", "over words", "tall tiles", "wide tiles", "narrow rows"],
)
def test_sizes_at_which_rows_and_tiles_are_cut_give_the_labels_of_the_twin(height, width, segments):
    rng = np.random.default_rng(height)
    image = (rng.integers(0, 256, (height, width, 3)) // 4 + np.arange(width)[:, None] % 160).astype(np.uint8)
    options = {"max_num_iter": 2}
    np.testing.assert_array_equal(
        st.superpixels.slic(image, segments, threads=3, **options), twin.slic(image, segments, **options)
    )


def test_the_colours_are_those_of_scikit_image():
    from skimage.color import rgb2lab, rgb2xyz

    levels = np.linspace(0, 255, 18).astype(np.uint8)
    colors = np.stack(np.meshgrid(levels, levels, levels), axis=-1).reshape(-1, 18, 3)
    lab = twin.features(colors, "lab", 64.0) / 64
    np.testing.assert_allclose(lab, rgb2lab(colors), atol=COLOR_ATOL)
    np.testing.assert_allclose(
        twin.features(colors, "xyz", 64.0) / 64, 100 * rgb2xyz(colors), atol=COLOR_ATOL
    )
    np.testing.assert_allclose(twin.features(colors, "rgb", 64.0) / 64, colors / 2.55, atol=COLOR_ATOL)


def test_a_picture_of_plain_tiles_is_cut_along_their_borders():
    """Analytic: 4 x 6 tiles of 16 pixels whose colours differ by more than any place does."""
    rng = np.random.default_rng(1)
    tile = np.repeat(np.repeat(rng.permutation(24).reshape(4, 6), 16, axis=0), 16, axis=1)
    colors = np.stack(np.meshgrid([20, 120, 220], [20, 120, 220], [20, 120, 220]), axis=-1).reshape(-1, 3)
    labels = st.superpixels.slic(colors.astype(np.uint8)[tile], n_segments=24)
    assert labels.max() == 24
    assert metrics.boundary_recall(labels, tile, tolerance=0) == 1.0
    assert metrics.undersegmentation(labels, tile) == 0.0
    assert metrics.achievable_accuracy(labels, tile) == 1.0


def test_specks_that_join_across_bands_do_not_depend_on_the_number_of_threads():
    """Pure noise: nearly every region is smaller than the smallest, and all threads choose neighbours at once."""
    noise = np.random.default_rng(6).integers(0, 256, (150, 130, 3), dtype=np.uint8)
    one = st.superpixels.slic(noise, 200, threads=1)
    for threads in (2, 5):
        for _ in range(5):
            np.testing.assert_array_equal(st.superpixels.slic(noise, 200, threads=threads), one)


@settings(deadline=None, max_examples=40)
@given(
    height=hs.integers(1, 24), width=hs.integers(1, 24), segments=hs.integers(1, 60), seed=hs.integers(0, 10**6),
    levels=hs.integers(1, 6), hole=hs.booleans(),
)  # fmt: skip
def test_every_segment_is_one_piece_of_the_smallest_size_or_more(height, width, segments, seed, levels, hole):
    rng = np.random.default_rng(seed)
    image = (rng.integers(0, levels, (height, width, 3)) * (255 // levels)).astype(np.uint8)
    mask = rng.random((height, width)) < 0.7 if hole else None
    if hole and not mask.any():
        return
    labels = st.superpixels.slic(image, segments, mask=mask)
    inside = np.ones(labels.shape, bool) if mask is None else mask
    present = np.unique(labels[inside])
    np.testing.assert_array_equal(present, np.arange(1, len(present) + 1))
    assert (labels[~inside] == 0).all()
    assert pieces(labels, present) == [1] * len(present)
    first = [np.flatnonzero(labels == k)[0] for k in present]
    assert first == sorted(first)
    smallest = int(0.25 * (inside.sum() / segments))
    neighbors = {int(v) for pair in st.superpixels.adjacency(labels) if pair[0] > 0 for v in pair}
    for k in present:  # smaller ones only where the mask leaves them alone
        assert (labels == k).sum() >= smallest or int(k) not in neighbors


def test_views_and_read_only_arrays_work_as_copies_do():
    wanted = st.superpixels.slic(IMAGE[::-1, ::2].copy(), 30)
    np.testing.assert_array_equal(st.superpixels.slic(IMAGE[::-1, ::2], 30), wanted)
    frozen = IMAGE.copy()
    frozen.flags.writeable = False
    np.testing.assert_array_equal(st.superpixels.slic(frozen, 30), st.superpixels.slic(IMAGE, 30))
    np.testing.assert_array_equal(
        st.superpixels.slic(np.asfortranarray(IMAGE), 30), st.superpixels.slic(IMAGE, 30)
    )


def test_depth_cuts_where_colours_do_not():
    flat = np.full((64, 64, 3), 128, np.uint8)
    depth = np.where(np.arange(64) < 27, 1.0, 2.0)[None].repeat(64, axis=0)
    labels = st.superpixels.slic(flat, 16, depth=depth, depth_weight=50)
    assert metrics.boundary_recall(labels, depth > 1.5, tolerance=0) == 1.0


def test_a_video_follows_the_centres_of_the_last_image():
    frames = [np.roll(IMAGE, k, axis=1) for k in range(4)]
    video = st.superpixels.Video(60)
    np.testing.assert_array_equal(video.next(frames[0]), st.superpixels.slic(frames[0], 60))
    for frame in frames[1:]:
        labels = video.next(frame)
        assert video.iterations <= 2
        assert labels.max() == video.segments
    video.reset()
    np.testing.assert_array_equal(video.next(frames[0]), st.superpixels.slic(frames[0], 60))
    assert video.next(frames[0][:40]).shape == (40, 96)  # another size: anew


def test_the_residual_is_the_way_of_a_centre_however_many_there_are():
    ways = []
    for n in (20, 60, 200):
        video = st.superpixels.Video(n, first_num_iter=1)
        video.next(IMAGE)
        ways.append(video.residual)
    assert min(ways) > 0
    assert max(ways) < 1.2 * min(ways)


def test_regions_mean_colours_and_neighbours_are_those_of_plain_loops():
    labels = st.superpixels.slic(IMAGE, 40)
    found = st.superpixels.regions(labels, IMAGE)
    means = st.superpixels.mean_colors(IMAGE, labels)
    for i, k in enumerate(found.labels):
        y, x = np.nonzero(labels == k)
        assert found.areas[i] == len(x)
        np.testing.assert_allclose(found.centroids[i], [x.mean(), y.mean()])
        np.testing.assert_array_equal(found.boxes[i], [x.min(), y.min(), np.ptp(x) + 1, np.ptp(y) + 1])
        np.testing.assert_allclose(found.colors[i], IMAGE[y, x].mean(axis=0))
        np.testing.assert_array_equal(means[y[0], x[0]], np.floor(found.colors[i] + 0.5))
    pairs = {(int(a), int(b)) for a, b in st.superpixels.adjacency(labels)}
    wanted = {
        (min(a, b), max(a, b))
        for u, v in ((labels[:, 1:], labels[:, :-1]), (labels[1:], labels[:-1]))
        for a, b in zip(u.ravel().tolist(), v.ravel().tolist(), strict=True)
        if a != b
    }
    assert pairs == wanted


def test_marked_boundaries_lie_where_labels_change():
    labels = np.repeat([[1, 1, 2]], 2, axis=0)
    marked = st.superpixels.mark_boundaries(np.zeros((2, 3), np.uint8), labels, color=(9, 8, 7))
    np.testing.assert_array_equal(marked[..., 0], [[0, 9, 0], [0, 9, 0]])


@pytest.mark.parametrize("kind", ["made", "noise"])
def test_the_working_memory_and_the_labels_are_at_most_12_bytes_a_pixel_on_any_picture(kind):
    if kind == "made":
        image = region_picture(480, 640)[0]
    else:
        image = np.random.default_rng(0).integers(0, 256, (480, 640, 3), dtype=np.uint8)
    assert memory(image) <= 12


def test_the_command_writes_labels_and_pictures(tmp_path, capsys):
    import cv2

    source, out = tmp_path / "a.png", tmp_path / "cut"
    cv2.imwrite(str(source), IMAGE[..., ::-1])
    assert run(["superpixels", str(source), "--segments", "40", "--out", str(out)]) == 0
    labels = st.superpixels.slic(IMAGE, 40)
    np.testing.assert_array_equal(cv2.imread(str(out / "labels.png"), cv2.IMREAD_UNCHANGED), labels)
    for name, wanted in (
        ("boundaries", st.superpixels.mark_boundaries(IMAGE, labels)),
        ("mean", st.superpixels.mean_colors(IMAGE, labels)),
    ):
        np.testing.assert_array_equal(cv2.imread(str(out / f"{name}.png"))[..., ::-1], wanted)
    result = json.loads((out / "result.json").read_text())
    assert result["segments"] == labels.max()
    assert {p.name for p in out.iterdir()} == {"labels.png", "boundaries.png", "mean.png", "result.json"}
    assert "40" in capsys.readouterr().out
