# SPDX-License-Identifier: MIT
import copy
import json
import pickle
import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import sdftrack as st
from sdftrack.io.datasets.tum import PUBLISHED

PIXEL_TOLERANCE = 1e-9  # double arithmetic on numbers below 1e3
RAY_TOLERANCE_PX = 2e-4  # rays are float32: 6e-8 of the ray times a focal length below 1e3, and rounding
LENS = (0.1, -0.05, 0.001, -0.002, 0.02)
PINHOLE = {"fx": 600.0, "fy": 610.0, "width": 640, "height": 480}
CAMERA = st.Camera(600.0, 610.0, 320.5, 238.0, 640, 480)
LENS_CAMERA = st.Camera(600.0, 610.0, 320.5, 238.0, 640, 480, LENS)


@pytest.mark.parametrize("camera", [CAMERA, LENS_CAMERA, *PUBLISHED.values()])
def test_projection_undoes_back_projection(camera):
    depth = np.full(camera.shape, 0.9, np.float32)
    points = camera.back_project(depth)
    assert points.shape == (camera.height, camera.width, 3)
    v, u = np.mgrid[: camera.height, : camera.width]
    np.testing.assert_allclose(camera.project(points), np.stack([u, v], -1), atol=RAY_TOLERANCE_PX)
    np.testing.assert_allclose(points[..., 2], depth)


def test_the_lens_is_that_of_opencv():
    cv2 = pytest.importorskip("cv2")
    p = np.random.default_rng(0).uniform([-0.4, -0.3, 0.8], [0.4, 0.3, 1.5], (50, 3))
    for lens in (LENS[:4], LENS, (*LENS, 0.03, -0.01, 0.005)):
        camera = st.Camera(600, 610, 320.5, 238, 640, 480, lens)
        expected = cv2.projectPoints(p, np.zeros(3), np.zeros(3), camera.K, np.array(lens))[0][:, 0]
        np.testing.assert_allclose(camera.project(p), expected, atol=PIXEL_TOLERANCE)


def test_a_point_behind_the_camera_has_no_pixel():
    px = CAMERA.project([[0, 0, 1], [0, 0, -1], [0, 0, 0]])
    assert np.isfinite(px[0]).all()
    assert np.isnan(px[1:]).all()


def test_pixels_without_depth_have_the_origin_as_point():
    depth = np.full(CAMERA.shape, np.nan, np.float32)
    depth[0, 0], depth[1, 1] = 0, 2
    points = CAMERA.back_project(depth)
    assert np.count_nonzero(points.any(-1)) == 1
    assert points[1, 1, 2] == 2


def test_scaling_keeps_the_image_in_place():
    half = CAMERA.scaled(0.5)
    assert (half.width, half.height, half.fx) == (320, 240, 300)
    p = [[0.1, -0.05, 0.8]]
    # The centre of a 2 x 2 block is the centre of the pixel that replaces it.
    np.testing.assert_allclose((CAMERA.project(p) + 0.5) / 2 - 0.5, half.project(p), atol=PIXEL_TOLERANCE)
    np.testing.assert_allclose(half.scaled(2).K, CAMERA.K, atol=PIXEL_TOLERANCE)


def test_cropping_shifts_pixels():
    part = LENS_CAMERA.cropped(100, 50, 200, 120)
    p = [[0.1, -0.05, 0.8]]
    np.testing.assert_allclose(part.project(p), LENS_CAMERA.project(p) - [100, 50], atol=PIXEL_TOLERANCE)
    assert part.shape == (120, 200)


def test_field_of_view_spans_the_image():
    camera = st.Camera.from_fov(np.pi / 2, 640, 480)
    assert (camera.fx, camera.cx, camera.cy) == (pytest.approx(320), 319.5, 239.5)
    with pytest.raises(ValueError, match=r"fov_x_rad: expected radians between 0 and pi, got 4\.94066e-324"):
        st.Camera.from_fov(5e-324, 640, 480)  # its tangent is 0


def test_cameras_are_values():
    for camera in (CAMERA, LENS_CAMERA, st.RGBDCamera(CAMERA, LENS_CAMERA, T_color_depth=np.eye(4))):
        getattr(camera, "_core", None)
        assert pickle.loads(pickle.dumps(camera)) == camera
        assert copy.deepcopy(camera) == camera
        assert hash(copy.copy(camera)) == hash(camera)
    assert CAMERA != LENS_CAMERA
    assert st.Camera.from_K(LENS_CAMERA.K, 640, 480, LENS) == LENS_CAMERA
    assert st.Camera(600.0, 610.0, 320.5, 238.0, 640, 480, np.zeros(5)) == CAMERA
    with pytest.raises(AttributeError):
        CAMERA.fx = 3


@pytest.mark.parametrize("camera", [CAMERA, LENS_CAMERA])
def test_saved_cameras_come_back(tmp_path, camera):
    camera.save(tmp_path / "cam.json")
    assert st.Camera.load(tmp_path / "cam.json") == camera
    assert [p.name for p in tmp_path.iterdir()] == ["cam.json"]
    with pytest.raises(ValueError, match="width"):
        st.Camera.load(tmp_path / "cam.json", width=320, height=240)


def _ros_yaml(rows_on_one_line: bool) -> str:
    K = "[600.0, 0.0, 320.5, 0.0, 610.0, 238.0, 0.0, 0.0, 1.0]"
    D = str(list(LENS))
    if not rows_on_one_line:
        K = "\n  " + "\n  ".join(f"- {x}" for x in json.loads(K))
        D = "\n  " + "\n  ".join(f"- {x}" for x in LENS)
    return (
        "image_width: 640\nimage_height: 480\ncamera_name: head\n"
        f"camera_matrix:\n  rows: 3\n  cols: 3\n  data: {K}\n"
        "distortion_model: plumb_bob\n"
        f"distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: {D}\n"
        "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
    )


def test_files_of_other_programs_are_read(tmp_path):
    column_major = CAMERA.K.T.ravel().tolist()
    o3d = {"width": 640, "height": 480, "intrinsic_matrix": column_major}
    bop = {**PINHOLE, "cx": 320.5, "cy": 238.0, "depth_scale": 0.1}
    (tmp_path / "intrinsic.json").write_text(json.dumps(o3d))
    (tmp_path / "camera.json").write_text(json.dumps(bop))
    np.savetxt(tmp_path / "cam_K.txt", CAMERA.K)
    assert st.Camera.load(tmp_path / "intrinsic.json") == CAMERA
    assert st.Camera.load(tmp_path / "camera.json") == CAMERA
    assert st.Camera.load(tmp_path / "cam_K.txt", width=640, height=480) == CAMERA
    for one_line in (True, False):
        (tmp_path / "ros.yaml").write_text(_ros_yaml(one_line))
        assert st.Camera.load(tmp_path / "ros.yaml") == LENS_CAMERA


def _realsense(model: str, coeffs: tuple[float, ...]) -> SimpleNamespace:
    return SimpleNamespace(**PINHOLE, ppx=320.5, ppy=238.0, model=f"distortion.{model}", coeffs=coeffs)


FIT_TOLERANCE_PX = 0.3  # what from_realsense promises for converted lenses


def bent(x, y, modified):
    """The printed polynomial; the modified model applies the tangential terms to what the radial ones have made."""
    k1, k2, p1, p2, k3 = LENS
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    a, b = (x * radial, y * radial) if modified else (x, y)
    u = x * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a)
    return u, y * radial + 2 * p2 * a * b + p1 * (r2 + 2 * b * b)


def test_inverse_brown_conrady_undistorts():
    # The model's definition: its polynomial takes distorted coordinates to ideal ones.
    camera = st.Camera.from_realsense(_realsense("inverse_brown_conrady", LENS))
    u, v = np.meshgrid(np.linspace(0, 639, 20), np.linspace(0, 479, 20))
    x, y = (u - 320.5) / 600, (v - 238) / 610
    ideal = np.stack([*bent(x, y, modified=False), np.ones_like(x)], -1)
    np.testing.assert_allclose(camera.project(ideal), np.stack([u, v], -1), atol=FIT_TOLERANCE_PX)
    wrong_way = LENS_CAMERA.project(ideal)
    assert abs(wrong_way - np.stack([u, v], -1)).max() > 30 * FIT_TOLERANCE_PX


def test_modified_brown_conrady_is_converted():
    camera = st.Camera.from_realsense(_realsense("modified_brown_conrady", LENS))
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-0.5, 0.5, 200), rng.uniform(-0.35, 0.35, 200)
    distorted_x, distorted_y = bent(x, y, modified=True)
    px = camera.project(np.stack([x, y, np.ones_like(x)], -1))
    expected = np.stack([600 * distorted_x + 320.5, 610 * distorted_y + 238], -1)
    np.testing.assert_allclose(px, expected, atol=FIT_TOLERANCE_PX)


def test_plain_realsense_lenses_pass_unchanged():
    assert st.Camera.from_realsense(_realsense("brown_conrady", LENS)) == LENS_CAMERA
    assert st.Camera.from_realsense(_realsense("inverse_brown_conrady", (0.0,) * 5)) == CAMERA
    assert st.Camera.from_realsense(_realsense("none", (0.0,) * 5)) == CAMERA


def test_ros_messages_of_both_generations_are_read():
    common = {"width": 640, "height": 480, "distortion_model": "plumb_bob"}
    one = SimpleNamespace(**common, K=CAMERA.K.ravel(), D=list(LENS))
    two = SimpleNamespace(**common, k=CAMERA.K.ravel(), d=list(LENS))
    assert st.Camera.from_ros(one) == st.Camera.from_ros(two) == LENS_CAMERA

    def changed(**values):
        return st.Camera.from_ros(SimpleNamespace(**{**vars(two), **values}))

    assert changed(distortion_model="", d=[]) == CAMERA
    for d in (list(LENS), [0.0] * 4):  # all zero is not a pinhole for this lens
        with pytest.raises(ValueError, match="distortion_model"):
            changed(distortion_model="equidistant", d=d)
    with pytest.raises(ValueError, match="binning"):
        changed(binning_x=2, binning_y=2)


def test_points_map_to_colour_by_pose_or_projectively():
    T = st.geometry.pose([0, 0.01, 0], [0.025, 0, 0])
    color = st.Camera(500, 500, 300, 200, 640, 480)
    rig = st.RGBDCamera(CAMERA, color, T_color_depth=T)
    p = np.random.default_rng(2).uniform([-0.3, -0.2, 0.6], [0.3, 0.2, 1.5], (20, 3))
    expected = rig.project_to_color(p)
    P = color.K @ T[:3, :3] @ np.linalg.inv(CAMERA.K)
    projective = st.RGBDCamera(CAMERA, projective=(P, color.K @ T[:3, 3]))
    np.testing.assert_allclose(projective.project_to_color(p), expected, atol=1e-6)
    assert not projective.aligned
    assert st.RGBDCamera(CAMERA).aligned
    np.testing.assert_array_equal(st.RGBDCamera(CAMERA).project_to_color(p), CAMERA.project(p))


def test_a_realsense_profile_gives_both_cameras():
    intrinsics = _realsense("none", (0.0,) * 5)
    T = st.geometry.pose([0, 0.1, 0], [0.015, 0, 0.001])
    extrinsics = SimpleNamespace(rotation=T[:3, :3].T.ravel().tolist(), translation=T[:3, 3].tolist())

    class Stream(SimpleNamespace):
        def stream_type(self):
            return f"stream.{self.kind}"

        def as_video_stream_profile(self):
            return self

        def get_intrinsics(self):
            return intrinsics

        def get_extrinsics_to(self, other):
            assert other.kind == "color"
            return extrinsics

    streams = [Stream(kind="color"), Stream(kind="infrared"), Stream(kind="depth")]
    rig = st.RGBDCamera.from_realsense(SimpleNamespace(get_streams=lambda: streams))
    assert rig == st.RGBDCamera(CAMERA, CAMERA, T_color_depth=rig.T_color_depth)
    np.testing.assert_allclose(rig.T_color_depth, T, atol=1e-12)
    with pytest.raises(ValueError, match="depth"):
        st.RGBDCamera.from_realsense(SimpleNamespace(get_streams=lambda: streams[:1]))


OF_ANOTHER_SIZE = [
    ((1224, 640, 480), (640, 480), "corner of the 640 x 480 image: .* of a 1280 x 960 image, 2 times"),
    ((613, 320, 240), (1280, 960), "off the middle .* of a 640 x 480 image, 0.5 times"),
    ((918, 640, 360), (640, 480), "outside .* of a 1280 x 720 image, 2 x 1.5 times"),
    ((525, 319.5, 239.5), (512, 424), "off the middle .* of a 640 x 480 image"),
    ((365, 256, 212), (640, 576), "off the middle .* of a 512 x 424 image"),
    ((2400, 849.5, 634.5), (640, 480), "of a 1697 x 1272 image, 2.65 x 2.65 times"),
    ((600, -50, 100), (640, 480), "outside .* right only for a crop"),
    ((30, 320, 240), (640, 480), "below a tenth of the 640 x 480 image"),
]


@pytest.mark.parametrize(("values", "size", "words"), OF_ANOTHER_SIZE)
def test_intrinsics_of_another_image_size_are_told_with_that_size(values, size, words, tmp_path):
    f, cx, cy = values
    K = [[f, 0, cx], [0, f, cy], [0, 0, 1]]
    with pytest.warns(UserWarning, match=words):
        st.Camera.from_K(K, *size)
    np.savetxt(tmp_path / "cam_K.txt", K)
    with pytest.warns(UserWarning, match=f"cam_K.txt: .*{words}"):
        st.Camera.load(tmp_path / "cam_K.txt", *size)


def test_real_cameras_and_crops_are_not_doubted():
    real = [
        (592.8, 596.1, 321.2, 236.4, 640, 480), (319.6, 417.1, 320.2, 244.3, 640, 480),
        (1066.8, 1067.5, 313.0, 241.3, 640, 480), (1076.7, 1075.9, 365.0, 289.1, 720, 540),
        (1075.7, 1073.9, 181.1, 210.9, 400, 400), (425.2, 425.2, 424.9, 237.4, 848, 480),
        (504.6, 504.6, 322.6, 337.9, 640, 576),
    ]  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for fx, fy, cx, cy, w, h in real:
            camera = st.Camera.from_K([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], w, h)
            camera.scaled(0.5).cropped(0, 0, w // 4, h // 4)


def test_normalised_intrinsics_are_refused():
    with pytest.raises(
        ValueError, match=r"expected pixels, got 0.82, 1.09, 0.5, 0.5 .* multiplied by the image's width"
    ):
        st.Camera(0.82, 1.09, 0.5, 0.5, 640, 480)
    st.Camera(3, 3, 2, 2, 5, 5)  # a picture of a few pixels
