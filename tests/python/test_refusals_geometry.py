# SPDX-License-Identifier: MIT
"""What cameras, frames, volumes, meshes and metrics refuse, in one line that names the argument."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import assert_refused, refused
from tracking_scene import box_mesh

import sdftrack as st
from sdftrack import _core, geometry, metrics

CAMERA = st.Camera(500.0, 510.0, 319.5, 239.5, 640, 480)
FOLDING = (-0.45, 0.2, 0, 0, -0.04)
DEPTH, RAW = np.full((12, 16), 0.8, np.float32), np.full((12, 16), 800, np.uint16)
COLOR = np.zeros((12, 16, 3), np.uint8)
SMALL = st.Camera(20, 20, 7.5, 5.5, 16, 12)
ONES = np.ones((4, 4, 4), np.float32)
BALL = st.SDF.sphere(0.05, voxels=20)
BOX = box_mesh()
T = geometry.pose([0.3, -0.2, 0.9], [0.02, 0.01, 0.8])


def camera(**change):
    return dataclasses.replace(CAMERA, **change)


def lens(model, *coefficients):
    own = {name: getattr(CAMERA, name) for name in ("width", "height", "fx", "fy")}
    return SimpleNamespace(
        **own, ppx=CAMERA.cx, ppy=CAMERA.cy, model=f"distortion.{model}", coeffs=coefficients
    )


@refused(
    (lambda: camera(distortion=(0.1, 0.2, 0, np.nan)), ValueError, "finite"),
    (lambda: camera(fx=320, fy=320, distortion=FOLDING), ValueError, r"folds over before pixel \(0, 0\)"),
    (lambda: st.Camera.from_K([[500, 3, 320], [0, 500, 240], [0, 0, 1]], 640, 480), ValueError, "skew"),
    (lambda: st.Camera.from_K(CAMERA.K.T, 640, 480), ValueError, "fx, 0, cx"),
    (lambda: CAMERA.back_project(np.ones(CAMERA.shape, np.uint16)), TypeError, "depth scale"),
    (lambda: st.Camera.from_realsense(lens("ftheta", 0.1, 0, 0, 0, 0)), ValueError, "rectify"),
    (lambda: st.Camera.from_realsense(lens("inverse_brown_conrady", -2.5, 0, 0.3, 0.3, 0)), ValueError, "px"),
    (lambda: st.RGBDCamera(CAMERA, SMALL), ValueError, "T_color_depth"),
    (lambda: st.RGBDCamera(CAMERA, CAMERA, np.eye(4), (np.eye(3), np.zeros(3))), ValueError, "both"),
    (lambda: st.RGBDCamera(CAMERA, CAMERA, T_color_depth=np.diag([2.0, 2, 2, 1])), ValueError, "rotation"),
)
def test_a_camera_that_cannot_be_says_why(call, error, words):
    assert_refused(call, error, words)


ROS = (
    "image_width: 640\nimage_height: 480\ncamera_matrix:\n  data: [500.0, 0, 319.5, 0, 500.0, 239.5, 0, 0, 1]\n"
    "distortion_model: equidistant\ndistortion_coefficients:\n  data: [0.1, 0, 0, 0]\n"
)


@pytest.mark.parametrize(
    ("name", "text", "error", "words"),
    [
        ("cam_K.txt", "500 0 319.5 0 500 239.5 0 0 1", ValueError, "width= and height="),
        ("short.txt", "1 2 3", ValueError, "9 numbers"),
        ("cut.json", "{", ValueError, "not a JSON file"),
        ("part.yaml", "image_width: 640\n", ValueError, "'height' is missing"),
        ("fisheye.yaml", ROS, ValueError, "equidistant"),
    ],
)
def test_a_camera_file_that_cannot_be_read_is_named(tmp_path, name, text, error, words):
    (tmp_path / name).write_text(text)
    assert_refused(lambda: st.Camera.load(tmp_path / name), error, words)


@refused(
    (lambda: st.Frame(DEPTH.astype(np.uint8)), TypeError, "depth: expected float32"),
    (lambda: st.Frame(RAW), ValueError, "depth_scale: expected metres per unit"),
    (lambda: st.Frame(RAW, depth_scale=1000), ValueError, "1/1000"),
    (lambda: st.Frame(1000 * DEPTH), ValueError, "millimetres: multiply depth by 0.001"),
    (lambda: st.Frame(0.001 * DEPTH), ValueError, "multiply depth by 1000"),
    (lambda: st.Frame(DEPTH, depth_scale=0.001), ValueError, "already in metres"),
    (lambda: st.Frame(None), ValueError, "at least one"),
    (lambda: st.Frame(DEPTH, COLOR.astype(np.float32)), TypeError, "uint8"),
    (lambda: st.Frame(DEPTH, COLOR[..., 0]), ValueError, "grey"),
    (lambda: st.Frame(DEPTH, mask=np.ones((16, 12), bool)), ValueError, "mask"),
    (lambda: st.Frame(DEPTH.T, camera=SMALL), ValueError, "camera"),
)
def test_a_frame_that_cannot_be_says_why(call, error, words):
    assert_refused(call, error, words)


def box_with(vertices=None, faces=None, **options):
    v = BOX.vertices if vertices is None else vertices
    f = BOX.faces if faces is None else faces
    return st.SDF.from_mesh((v, f), **{"voxels": 30, **options})


def with_nan():
    out = BOX.vertices.copy()
    out[0, 0] = np.nan
    return out


def far_apart(join):
    near = st.SDF.sphere(0.004, voxels=24, padding=0.5)
    return join(near, near.transformed(geometry.pose([0, 0, 0], [0.5, 0.5, 0.5])))


def long_bar():
    bar = st.SDF(np.ones((2, 2, 1200), np.float32), 0.001, (0, 0, 0))
    return bar.transformed(geometry.pose([0.3, 0.6, 0.6]))


def of_size(voxel_m):
    return st.SDF(np.ones((2, 2, 2), np.float32), voxel_m, (0, 0, 0))


@refused(
    (lambda: box_with(BOX.vertices[:0], BOX.faces[:0]), ValueError, "it is empty"),
    (lambda: box_with(faces=BOX.faces[:3]), ValueError, "expected a closed surface"),
    (lambda: box_with(with_nan()), ValueError, "1 of 8 vertices are NaN or infinite and belong to faces"),
    (lambda: box_with(1000 * BOX.vertices), ValueError, r"longest side is 120 m.*pass unit='mm'"),
    (lambda: box_with(BOX.vertices * [1, 1, 0.01]), ValueError, r"shortest side .*under 4 voxels.*voxels="),
    (lambda: box_with(faces=np.concatenate([BOX.faces, BOX.faces + 8])), ValueError, "vertex indices"),
    (lambda: st.SDF.cone(65536, 1e13, voxels=16), ValueError, "expected positive lengths"),
    (lambda: st.SDF(ONES[:, :1], 0.01, (0, 0, 0)), ValueError, "at least 2 voxels"),
    (lambda: st.SDF(np.nan * ONES, 0.01, (0, 0, 0)), ValueError, "values: expected finite"),
    (lambda: st.SDF(ONES, 0.01, (0, 0, 0)).redistanced(), ValueError, "one sign only"),
    (lambda: st.SDF(ONES, 0.01, (0, 0, 0)).to_mesh(), ValueError, "no surface"),
    (lambda: st.SDF(ONES, 0.01, (0, 0, 0)).cropped(), ValueError, "outside everywhere"),
    (lambda: far_apart(st.union), ValueError, r"much more than what it is made of"),
    (long_bar, ValueError, r"much more than what it is made of"),
    (lambda: st.union(of_size(1e-12), of_size(1e12)), ValueError, "at most 1200 a side"),
    (lambda: BALL.render(SMALL, np.diag([1.0, 1, -1, 1])), ValueError, "T_cam_obj"),
    (lambda: st.Symmetry.from_bop({"symmetries_discrete": [[1, 2]]}), ValueError, "expected"),
    (lambda: st.Symmetry.from_bop({"symmetries_continuous": [{"offset": [0] * 3}]}), ValueError, "expected"),
)
def test_a_volume_that_cannot_be_says_why(call, error, words):
    assert_refused(call, error, words)


def huge(of):
    return np.lib.stride_tricks.as_strided(np.ones(1, np.float32), of, (0, 0, 0))


def solid(kind, voxels):
    return _core.primitive_sdf(kind, [0.1], voxels, 0.01, [0, 0, 0])


def volume_of_box(voxels):
    return _core.mesh_to_sdf(BOX.vertices, BOX.faces, voxels, 0.01, [0, 0, 0])


BEYOND = [65536, 65536, 2]


@refused(
    (lambda: solid("sphere", BEYOND), ValueError, r"than 2\^31 voxels"),
    (lambda: volume_of_box(BEYOND), ValueError, r"than 2\^31 vox"),
    (lambda: _core.redistance(huge(BEYOND), 0.01), (TypeError, ValueError), "."),
)
def test_the_core_refuses_volumes_that_it_cannot_count(call, error, words):
    assert_refused(call, error, words)


def mesh(vertices=((0, 0, 0),), faces=((0, 0, 0),), *more):
    return st.Mesh(vertices, faces, *more)


POINT = st.Mesh([[0, 0, 0]], [], COLOR[0, :1])


def saved(name, of=BOX, **options):
    return lambda folder: of.save(folder / name, **options)


@refused(
    (lambda: mesh(faces=[[0, 0, 1]]), ValueError, r"faces: expected vertex indices 0\.\.0"),
    (lambda: st.Mesh([], []).raycast(SMALL, T), ValueError, "at least one face"),
    (lambda: st.Mesh(with_nan(), BOX.faces).raycast(SMALL, T), ValueError, "vertices: every coordinate"),
    (lambda: st.Mesh([], []).bounds, ValueError, "no vertices"),
    (lambda: metrics.average_recall(), ValueError, "at least one"),
    (lambda: geometry.look_at([0, 0, 1], [0, 0, 0]), ValueError, "up"),
)
def test_a_mesh_or_a_measure_that_cannot_be_says_why(call, error, words):
    assert_refused(call, error, words)


@refused(
    (saved("box.xyz"), ValueError, "path: expected a name ending"),
    (saved("b.stl", texture=64), ValueError, "path: expected one of .ply, .obj, .glb with texture="),
    (saved("b.glb", colors_from=BOX), ValueError, "colors_from: requires texture="),
    (saved("b.glb", texture=64), ValueError, "expected a mesh with colours"),
    (saved("b.glb", POINT, texture=64), ValueError, "expected a mesh with faces"),
    (lambda folder: st.Mesh.load(folder / "absent.ply"), FileNotFoundError, r"absent\.ply"),
)
def test_a_mesh_that_cannot_be_saved_leaves_no_file(call, error, words, tmp_path):
    assert_refused(call, error, words, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_no_mesh_is_refused_with_its_name(tmp_path):
    (tmp_path / "text.ply").write_text("this is not a mesh")
    BOX.save(tmp_path / "box.ply")
    whole = (tmp_path / "box.ply").read_bytes()
    (tmp_path / "cut.ply").write_bytes(whole[: len(whole) // 2])
    for name in ("text.ply", "cut.ply"):
        with pytest.raises(ValueError, match=name):
            st.Mesh.load(tmp_path / name)
    with pytest.raises(ValueError, match="unit: expected"):
        st.Mesh.load(tmp_path / "box.ply", unit="feet")


@pytest.mark.parametrize("part", [0, 3])
def test_a_twist_without_end_is_refused(part):
    twist = np.zeros(6)
    twist[part] = 1e300
    assert_refused(lambda: geometry.exp(twist), ValueError, "expected")
