# SPDX-License-Identifier: MIT
"""What fits, planes, calibrations, level sets, reconstructions and synthesis refuse, in one line that names it."""

import functools

import numpy as np
from ball_scenes import DEPTH, RADIUS_M, recorded
from refusals import assert_refused, refused
from tracking_scene import CAMERA, POSE, box_mesh, depth_of

import sdftrack as st
from sdftrack import _core
from sdftrack.synth import Cover, Grip, leave_and_return

NOTHING = np.zeros(CAMERA.shape, bool)
SMALL_FRAME = st.Frame(np.ones((10, 10), np.float32))
RNG = np.random.default_rng(0)
ON_BALL = RNG.normal(size=(50, 3))
ON_BALL = 0.05 * ON_BALL / np.linalg.norm(ON_BALL, axis=1, keepdims=True) + [0.1, 0.2, 0.8]
FLAT = ON_BALL * [1, 1, 0] + [0, 0, 1]
WITH_NAN = np.where(np.arange(50)[:, None] % 40 == 3, np.nan, ON_BALL)
I4 = np.eye(4)


@functools.cache
def frame():
    return st.Frame(depth_of())


def fit(points=ON_BALL, kind="sphere", **options):
    return st.fit_primitive(points, kind, **options)


def fit_frame(of=None, kind="box", **options):
    return st.fit_primitive(of or frame(), kind, **{"camera": CAMERA, **options})


@refused(
    (lambda: fit(np.zeros((0, 3)), "auto"), ValueError, "at least 4, as many as there are unknowns, got 0"),
    (lambda: fit(np.zeros((7, 3)), "plane"), ValueError, "at least 8.*got 7"),
    (lambda: fit(WITH_NAN), ValueError, "2 of 50 points with NaN"),
    (lambda: fit(np.outer(np.arange(50.0), [0.01, 0.02, 0.03]), "plane"), ValueError, "in one line"),
    (lambda: fit(FLAT, "auto"), ValueError, "in one plane; fit kind='plane'"),
    (lambda: fit(np.ones((50, 3))), ValueError, "a single location"),
    (lambda: fit(1e3 * ON_BALL), ValueError, r"metres, .* an extent of .*pass unit='mm'"),
    (lambda: fit(camera=CAMERA), ValueError, "camera: expected None with points"),
    (lambda: fit(kind="auto", initial=(I4, {"radius": 1})), ValueError, "initial: expected a kind"),
    (lambda: fit(kind="box", initial=(I4, {"radius": 1})), ValueError, "x, y, z"),
    (lambda: fit(plane=([0, 0, 0], 1)), ValueError, "plane"),
    (lambda: fit_frame(camera=None), ValueError, "camera: expected the depth camera of the frame, got None"),
    (lambda: fit_frame(camera=CAMERA.scaled(0.5)), ValueError, "camera: expected the depth image's size"),
    (lambda: fit_frame(mask=NOTHING), ValueError, "mask: expected some depth measurements"),
    (lambda: fit_frame([st.Frame.unreadable("torn")]), ValueError, "frames: expected at least one"),
    (lambda: fit_frame([frame(), "x"], mask=depth_of() < 1), TypeError, "expected st.Frame, got str at 1"),
)
def test_a_fit_of_a_primitive_that_cannot_be_says_why(call, error, words):
    assert_refused(call, error, words)


TABLE = (1 / (0.4 + 0.006 * np.arange(240)[:, None] + np.zeros((1, 320)))).astype(np.float32)
ROUGH = RNG.uniform(0.4, 3, CAMERA.shape)
WITH_HOLE = TABLE.copy()
WITH_HOLE[195:206, 55:66] = 0


def only(rows, columns):
    depth = np.zeros_like(TABLE)
    depth[rows, columns] = TABLE[rows, columns]
    return depth


def with_ball():
    near = st.SDF.sphere(0.06, voxels=60).render(CAMERA, st.geometry.pose(t_m=[0, 0, 0.45]))[0]
    return np.where(near > 0, near, TABLE)


def plane(depth=TABLE, camera=CAMERA, **options):
    return st.remove_plane(st.Frame(depth.astype(np.float32)), camera, **options)


@refused(
    (lambda: plane(ROUGH), ValueError, "no plane contains a tenth"),
    (lambda: plane(TABLE * np.nan), ValueError, "almost none"),
    (lambda: plane(only(slice(148, 155), slice(160, 163))), ValueError, "almost none"),
    (lambda: plane(tolerance=10), ValueError, "at most 0.5 m.*millimetres"),
    (lambda: plane(start_px=(320, 10)), ValueError, "start_px"),
    (lambda: plane(WITH_HOLE, start_px=(60, 200)), ValueError, "start_px.*got none"),
    (lambda: plane(with_ball(), start_px=(160, 120)), ValueError, "start_px.*(flat|tenth)"),
)
def test_a_plane_that_is_not_there_says_why(call, error, words):
    assert_refused(call, error, words)


def intrinsics(**change):
    given = {"frames": [frame()] * 6, "sdf": st.SDF.sphere(0.05, voxels=20), "initial_camera": CAMERA}
    return st.calibrate_intrinsics(**{**given, "initial_pose": POSE, **change})


@refused(
    (lambda: intrinsics(free=("fx", "k3")), ValueError, "k3"),
    (lambda: intrinsics(frames=[SMALL_FRAME] * 6), ValueError, r"the camera's size \(240, 320\)"),
    (lambda: intrinsics(box=(1, 2, 3, 4)), ValueError, "one of pose, mask and box"),
    (lambda: intrinsics(residual="slope"), ValueError, "residual: expected one of ray_hit, point"),
)
def test_intrinsics_that_cannot_be_found_say_why(call, error, words):
    assert_refused(call, error, words)


def no_ball(shape=(240, 320)):
    return lambda f: np.zeros(shape, bool)


def color(few=8, **change):
    scene, frames = recorded(noise=0.001, seed=0)
    given = {"frames": frames[:few], "depth_camera": DEPTH, "ball_radius": RADIUS_M}
    return st.calibrate_color_to_depth(**{**given, "ball_color": scene.color, **change})


def without_times():
    return [f.replace(timestamp=None) for f in recorded(noise=0.001, seed=0)[1][:8]]


def mixed():
    """Colour images of other moments than their depth images."""
    frames = recorded(noise=0.001, seed=0)[1]
    return [st.Frame(frames[i].depth, frames[(5 * i + 3) % 12].color, frames[i].timestamp) for i in range(12)]


def by_mask(mask_fn):
    return color(ball_color=None, mask_fn=mask_fn)


@refused(
    (lambda: color(ball_radius=40), ValueError, "ball_radius: expected metres.*40 mm is 0.04"),
    (lambda: color(ball_radius=0.15), ValueError, "found no ball of ball_radius=0.15"),
    (lambda: color(ball_color=(0, 40, 230)), ValueError, "^ball_color: found no round object"),
    (lambda: color(mask_fn=no_ball()), ValueError, "ball_color, mask_fn: expected one"),
    (lambda: by_mask(no_ball()), ValueError, "^mask_fn: found no"),
    (lambda: by_mask(no_ball((2, 3))), ValueError, "^mask_fn: expected a bool"),
    (lambda: color(depth_camera=DEPTH.scaled(2)), ValueError, "^depth_camera: frame"),
    (lambda: color(frames=[st.Frame(np.ones((240, 320), np.float32))]), ValueError, "got none with both"),
    (lambda: color(frames=without_times(), time_offset=True), ValueError, "^time_offset: expected frames"),
    (lambda: color(frames=mixed()), ValueError, "are simultaneous|no mapping agrees|agree with one mapping"),
    (lambda: color(few=2, ball_color=None), ValueError, "^ball_color: expected .* with so few frames"),
)
def test_colour_that_cannot_be_registered_says_why(call, error, words):
    assert_refused(call, error, words)


@functools.cache
def phi():
    return st.SDF.sphere(0.01, voxels=12).values


def evolve(**change):
    given = {"phi": phi(), "log_ratio": phi(), "steps": 1, "voxel_size": 0.002, "threads": 1}
    return st.levelset.evolve(**{**given, **change})


def evidence(**change):
    given = {"frame": frame(), "camera": CAMERA, "T_cam_obj": POSE, "grid": ((4, 4, 4), 0.01, (0, 0, 0))}
    return st.levelset.evidence(**{**given, **change})


@refused(
    (lambda: evolve(phi=np.inf * np.abs(phi())), ValueError, "phi: expected finite"),
    (lambda: evolve(phi=np.ones_like(phi())), ValueError, "one sign only"),
    (lambda: evolve(log_ratio=phi()[1:]), ValueError, "log_ratio: expected the shape"),
    (lambda: evolve(dt=1.6), ValueError, "dt: expected at most 1.4"),
    (lambda: evolve(sigma_phi=2), ValueError, "dt: expected at most 0.66"),
    (lambda: evidence(frame=SMALL_FRAME), ValueError, "depth: expected"),
    (lambda: evidence(grid=((4000, 4000, 4000), 0.01, (0, 0, 0))), ValueError, "fewer than 2\\^31"),
    (lambda: st.levelset.redistance(np.ones_like(phi()), 0.01), ValueError, "one sign only"),
)
def test_a_level_set_that_cannot_be_says_why(call, error, words):
    assert_refused(call, error, words)


def star(**options):
    return st.Reconstructor(CAMERA, **{"voxels": 48, **options})


def mask():
    return depth_of() < 1


def begun():
    made = star()
    made.start(frame(), mask=mask())
    return made


@functools.cache
def without_object():
    return st.Frame(np.where(mask(), 0, depth_of()).astype(np.float32))


def core(voxels=(32, 32, 32)):
    return _core.Reconstruction(voxels, 0.01, (-0.15, -0.15, -0.15), None, _core.ReconstructionOptions(), 1)


def fuse(*region):
    core().fuse(depth_of(), CAMERA._core, POSE, region)


@refused(
    (lambda: star().mesh(), RuntimeError, "call start"),
    (lambda: star().resume(frame(), mask=mask()), RuntimeError, "resume: call start"),
    (lambda: star().start(frame(), mask=~NOTHING), ValueError, "object alone"),
    (lambda: star().start(without_object(), mask=mask()), ValueError, "depth measurements on the object"),
    (lambda: star().start(frame()), ValueError, "one of mask, box and pose"),
    (lambda: star().start(frame(), pose=I4), ValueError, "requires Reconstructor"),
    (lambda: star(extent=0.05).start(frame(), mask=mask()), ValueError, "larger extent"),
    (lambda: star().start(SMALL_FRAME, mask=np.ones((10, 10), bool)), ValueError, "camera's size"),
    (lambda: star(voxels=2000), ValueError, "GiB"),
    (lambda: star(evolution="printed").resume(frame(), mask=mask()), ValueError, "only one recording"),
    (lambda: begun().resume(frame()), ValueError, "one of mask, box and pose, got none"),
    (lambda: fuse(0, 0, 321, 240), ValueError, "region: expected"),
)
def test_a_reconstruction_that_cannot_be_says_why(call, error, words):
    assert_refused(call, error, words)


def synthetic(**change):
    return st.synth.sequence(**{"shape_or_mesh": box_mesh(), "n": 2, "camera": CAMERA, **change})


@refused(
    (lambda: synthetic(trajectory=st.synth.random_walk(step_m=0.5)), ValueError, "step_m"),
    (lambda: synthetic(trajectory=np.tile(POSE, (3, 1, 1))), ValueError, r"\(2, 4, 4\)"),
    (lambda: synthetic(trajectory=np.tile(POSE @ np.diag([2, 2, 2, 1]), (2, 1, 1))), ValueError, "rotation"),
    (lambda: synthetic(occluder=1.5), ValueError, "fraction"),
    (lambda: synthetic(trajectory="static", occluder=Cover(0, 2, gap_m=0.7)), ValueError, "0.1 m"),
    (lambda: synthetic(clutter="jungle"), ValueError, "wall, table, objects"),
    (lambda: Grip(0.9), ValueError, "0 to 0.7"),
    (lambda: leave_and_return(apart_m=5.0), ValueError, "apart_m"),
)
def test_what_cannot_be_synthesised_says_why(call, error, words):
    assert_refused(call, error, words)
