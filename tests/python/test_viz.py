# SPDX-License-Identifier: MIT
"""Overlays: what is drawn where."""

import numpy as np
import pytest
from tracking_fakes import CAMERA, Ball, frame, pose, result

import sdftrack as st
from sdftrack.camera import RGBDCamera
from sdftrack.frame import Frame
from sdftrack.viz import draw
from sdftrack.viz.overlay import NOTHING_RGB, STATUS_RGB, backdrop, depth_picture


def rim_pixel(T):
    """A pixel on the ball's outline, to the right of its middle."""
    depth, _ = Ball().render(CAMERA, T)
    v = CAMERA.height // 2
    return v, int(np.flatnonzero(depth[v])[-1])


@pytest.mark.parametrize("status", ["ok", "weak", "lost"])
def test_the_outline_has_the_colour_of_the_status(status):
    T = pose()
    picture = draw(frame(0, T, color=True), result([T], [status]), Ball(), CAMERA)
    assert picture.shape == (*CAMERA.shape, 3)
    assert picture.dtype == np.uint8
    v, u = rim_pixel(T)
    near = picture[v - 1 : v + 2, u - 2 : u + 3].reshape(-1, 3).astype(int)
    assert np.abs(near - STATUS_RGB[status]).sum(axis=1).min() < 90  # antialiased, over grey


def test_a_hand_in_front_is_not_shaded_over():
    T = pose()
    f = frame(0, T, color=True)
    depth = f.depth.copy()
    depth[:, :75] = 0.3
    picture = draw(Frame(depth, f.color), result([T]), Ball(), CAMERA)
    v, u = 70, 66  # inside the ball, behind the hand, off the axes
    assert (picture[v, u] == 90).all()
    assert (picture[v, 95] != 90).any()


def test_an_object_out_of_view_or_behind_the_camera_draws_only_its_caption():
    for T in (pose(z=-0.5), pose(x=5.0)):
        picture = draw(frame(0, None, color=True), result([T]), Ball(), CAMERA)
        assert (picture[40:] == 90).all()


def test_two_objects_and_an_overlay_mesh():
    T = [pose(-0.1), pose(0.1)]
    picture = draw(frame(0, T[0], color=True), result(T), [Ball(), Ball()], CAMERA, meshes=[None, Ball()])
    v, u = np.round(CAMERA.project(T[1][:3, 3] + [0.02, 0.02, 0])[::-1]).astype(int)
    assert picture[v, u].min() > 150  # solid and bright
    v, u = np.round(CAMERA.project(T[0][:3, 3] + [0.02, 0.02, 0])[::-1]).astype(int)
    assert picture[v, u].min() < 120  # light shading only


@pytest.mark.parametrize("what", ["shapes", "meshes", "names"])
def test_a_wrong_count_is_named(what):
    given = {"shapes": [Ball()], "meshes": None, "names": None}
    given[what] = [Ball(), Ball()] if what == "shapes" else [None, None]
    with pytest.raises(ValueError, match=rf"{what}: expected 1, one per tracked object, got 2"):
        draw(frame(), result([pose()]), given["shapes"], CAMERA, given["meshes"], names=given["names"])


def test_without_colour_the_depth_is_shown_and_holes_are_dark():
    depth = np.full(CAMERA.shape, 1.0, np.float32)
    depth[:, :80] = 0.6
    depth[:10] = 0
    picture = depth_picture(depth)
    assert (picture[5] == NOTHING_RGB).all()
    assert picture[60, 20].mean() > picture[60, 140].mean() + 50  # near is brighter
    np.testing.assert_array_equal(backdrop(Frame(depth), CAMERA), picture)


def test_an_unreadable_frame_is_dark_with_its_status():
    picture = draw(Frame.unreadable("cut short"), result([pose()], ["bad_frame"]), Ball(), CAMERA)
    assert (picture[-5:, -5:] == NOTHING_RGB).all()


@pytest.mark.parametrize("form", ["projective", "rigid"])
def test_colour_is_warped_onto_the_depth_image(form):
    """A colour camera 40 mm to the right sees a plane at 0.8 m shifted by f 0.04 / 0.8 = 10 px."""
    T = np.eye(4)
    T[0, 3] = -0.04
    ramp = np.tile(np.arange(160, dtype=np.uint8), (CAMERA.height, 1))
    color = np.dstack([ramp] * 3)
    if form == "rigid":
        rig = RGBDCamera(CAMERA, CAMERA, T_color_depth=T)
    else:
        rig = RGBDCamera(CAMERA, CAMERA, projective=(np.eye(3), CAMERA.K @ T[:3, 3]))
    depth = np.full(CAMERA.shape, 0.8, np.float32)
    depth[50:60, 70:90] = 0  # a hole borrows its surroundings
    warped = backdrop(Frame(depth, color), rig)
    expected = np.arange(160) - 10.0
    np.testing.assert_allclose(warped[20, 20:, 0], expected[20:], atol=1)
    np.testing.assert_allclose(warped[55, 20:, 0], expected[20:], atol=1)


def test_the_outline_of_an_object_behind_another_is_hidden_there():
    behind, front = pose(0.0, 0.0, 0.7), pose(0.07, 0.0, 0.45)
    f = frame(0, front, color=True)
    both = draw(f, result([behind, front], ["lost", "ok"]), [Ball(), Ball()], CAMERA)
    covered = Ball().render(CAMERA, front)[0] > 0
    red = (both[..., 0].astype(int) - both[..., 1]) > 80
    rim = Ball().render(CAMERA, behind)[0] > 0
    inner = np.zeros_like(covered)
    inner[5:-5, 5:-5] = covered[5:-5, 5:-5] & covered[:-10, 5:-5] & covered[10:, 5:-5] & covered[5:-5, :-10]
    right = np.arange(160)[None, :] > CAMERA.project(behind[:3, 3])[0]
    assert (red & rim & ~right).any()
    assert not (red & inner)[:58].any()  # above the second ball's red x axis


def test_four_sides_begin_with_the_side_that_was_seen_and_go_round_by_the_right():
    from sdftrack.geometry import pose as turned
    from sdftrack.viz.turntable import PAPER_RGB, four_sides, turning

    ball = st.SDF.sphere(0.05, voxels=40).to_mesh()
    v = ball.vertices
    red, green, blue = (200, 30, 30), (30, 200, 30), (30, 30, 200)
    # In the first image (x right, z away from the viewer): red in front, green on the right, blue behind.
    colors = np.where(
        v[:, 2:] < -0.03, red, np.where(v[:, :1] > 0.03, green, np.where(v[:, 2:] > 0.03, blue, 90))
    )
    mesh = st.Mesh(v, ball.faces, colors.astype(np.uint8), seen=np.where(v[:, 0] < -0.03, 0.0, 1.0))
    size = 80
    picture = four_sides(mesh, np.eye(4), size)
    middles = [picture[size // 2, n * size + size // 2].astype(int) for n in range(4)]
    assert [int(m.argmax()) for m in middles[:3]] == [0, 1, 2]
    assert middles[3][2] > middles[3][0] > middles[3][1]  # violet: the left was not seen
    # From where it was seen, not along the object's own axes.
    T = turned([0.0, np.pi / 2, 0.0])
    other = four_sides(st.Mesh(v @ T[:3, :3], ball.faces, mesh.colors, seen=mesh.seen), T, size)
    assert np.mean(np.abs(other.astype(int) - picture) > 8) < 0.02
    first = next(iter(turning(mesh, np.eye(4), 4, size)))
    np.testing.assert_array_equal(first, picture[:size, :size])
    # Without colours and marks it is plain, and no line speaks of violet.
    plain = four_sides(ball, np.eye(4), size)
    assert plain.shape[0] < picture.shape[0]
    body = plain[:size][np.abs(plain[:size].astype(int) - PAPER_RGB).sum(axis=2) > 30]
    assert np.ptp(body.astype(int), axis=1).max() < 30


def test_a_notebook_shows_a_row_of_each_object():
    shown = result([pose(0.1), pose(z=0.6)], ["ok", "lost"])._repr_html_()
    assert shown.count("<tr>") == 3
    assert "<td>0</td><td>ok</td><td>0.90</td><td>100.0 0.0 500.0</td><td>0.1 0.1 0.1</td>" in shown
    assert "<td>1</td><td>lost</td><td>0.00</td><td>0.0 0.0 600.0</td>" in shown
    assert "made so by the test" in shown
