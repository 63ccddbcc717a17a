# SPDX-License-Identifier: MIT
"""What a page of docs/ takes for granted: files of the names that it uses, and the names that its code uses.

A page is run in a folder that has two short recordings of a duck in BOP's layout, `part.ply` (mm) and `mask.png`.
"""

import shutil

import cv2
import numpy as np
import pytest

import sdftrack as st

PAGES = {}


def page(name):
    def add(function):
        PAGES[name] = function
        return function

    return add


def duck(folder):
    """The frames of the first recording, its camera, and the mask and pose of frame 0."""
    seq = st.open_sequence(folder / "recording")
    mask = seq.masks(0)[0]
    names = {"st": st, "np": np, "seq": seq, "camera": seq.camera, "mask": mask, "frames": list(seq)}
    return names | {"frame": seq[0], "T_cam_obj": seq.ground_truth[0][0]}


def tracker(names, folder, **options):
    shape = st.SDF.from_mesh(st.Mesh.load(folder / "part.ply", unit="mm"), voxels=80)
    made = st.Tracker(shape, names["camera"], **options)
    made.start(names["frame"], poses=[names["T_cam_obj"]])
    return names | {"sdf": shape, "shape": shape, "tracker": made}


def metres(folder, name):
    """The duck's mesh in metres under another name."""
    mesh = st.Mesh.load(folder / "part.ply", unit="mm")
    mesh.save(folder / name)
    return mesh


def video(folder, data_dir, name):
    """The first 70 images of a recorded animal, as a list and as a folder."""
    source = data_dir / "davis" / name
    if not source.is_dir():
        pytest.skip(f"recorded data absent: {source} (set SDFTRACK_DATA)")
    paths = sorted((source / "rgb").iterdir())[:70]
    (folder / "VIDEO").mkdir()
    for path in paths:
        shutil.copy(path, folder / "VIDEO")
    images = [cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB) for path in paths]
    mask = cv2.imread(str(sorted((source / "mask").iterdir())[0]), cv2.IMREAD_GRAYSCALE) > 0
    return images, mask


@page("README.md")
def readme(folder, data_dir):
    """A recording in BOP's layout, and images of a recorded bottle under plain names."""
    (folder / "recording").rename(folder / "scene")
    (folder / "part.ply").rename(folder / "drill.ply")
    source, capture = data_dir / "mustard0", folder / "capture"
    if not source.is_dir():
        pytest.skip(f"recorded data absent: {source} (set SDFTRACK_DATA)")
    for name in ("depth", "rgb", "annotated_poses", "mesh"):
        (capture / name).mkdir(parents=True)
    with st.open_sequence(source) as seq:
        np.savetxt(capture / "cam_K.txt", seq.camera.depth.K)
        for i in range(12):
            shutil.copy(source / "depth" / f"{i:06d}.png", capture / "depth" / f"{i}.png")
            shutil.copy(source / "rgb" / f"{i:06d}.jpg", capture / "rgb" / f"{i}.jpg")
            np.savetxt(capture / "annotated_poses" / f"{i}.txt", seq.ground_truth[i][0])
        seq.models[1].save(capture / "mesh" / "bottle.ply")
    shutil.copy(source / "models" / "obj_000001.ply", folder / "bottle.ply")
    shutil.copy(source / "mask_visib" / "000000_000000.png", folder / "mask.png")
    return {}


@page("add_an_energy.md")
def nothing(folder, data_dir):
    return {}


@page("calibration.md")
def calibration(folder, data_dir):
    """A duck that visits the image; the page's guess is 10 % and 20 px off."""
    mesh = metres(folder, "metres.ply")
    (folder / "part.ply").rename(folder / "duck.ply")
    shutil.rmtree(folder / "recording")
    camera = st.Camera(572.0, 573.0, 320.0, 241.0, 640, 480)
    path = st.synth.sweep(near_m=0.5, far_m=0.9, reach_x=0.3, reach_y=0.22)
    made = st.synth.sequence(mesh, 60, path, 0.001, seed=3, camera=camera, color=False)
    st.save_sequence(folder / "recording", made)
    return {}


@page("color_calibration.md")
def color_calibration(folder, data_dir):
    from fault_commands import wand

    from experiments.synth.ball import ball_scene

    scene = ball_scene(24)
    wand(folder / "RECORDING", 24)
    names = tracker(duck(folder), folder)
    return names | {"frames": list(scene.sequence), "depth_camera": scene.camera.depth}


@page("contour.md")
def contour(folder, data_dir):
    images, mask = video(folder, data_dir, "camel")
    return {"images": images, "mask": mask}


@page("data.md")
def data(folder, data_dir):
    from motion_recordings import results_of, trajectory, write_folder

    names = duck(folder)
    small = st.Camera(105.0, 105.0, 79.5, 59.5, 160, 120)
    st.save_sequence(folder / "scene", st.synth.sequence(metres(folder, "drill.ply"), 14, camera=small))
    cup, other = trajectory(), trajectory(name="other", seed=1)
    write_folder(folder / "out", results_of(cup), cup.times_s)
    shutil.copy(folder / "out" / "poses.csv", folder / "poses.csv")
    pytest.importorskip("ezc3d", reason="ezc3d is not installed: pip install 'sdftrack[motion]'")
    st.motion.save(folder / "session.c3d", [cup, other])
    return names | {"ground_truth": {}, "models": {}}


@page("files.md")
def files(folder, data_dir):
    st.SDF.sphere(0.05, voxels=20).save(folder / "part.npz")
    return {}


@page("lwpr.md")
def lwpr(folder, data_dir):
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (50, 3))
    return {"stream": zip(x, x.sum(1), strict=True)}


@page("motion.md")
def motion(folder, data_dir):
    """An exercise, rendered and tracked by the commands."""
    from sdftrack.cli.app import run

    exercise = [
        "synth",
        "exercise",
        "--kind",
        "reach",
        "--object",
        "cup",
        "--repetitions",
        "2",
        "--fps",
        "15",
    ]
    assert run([*exercise, "--seed", "2", "--out", "week"]) == 0
    model = ["--model", "week/models/obj_000001.ply", "--unit", "mm", "--init", "gt"]
    assert run(["track", "week", *model, "--no-video", "--quiet", "--out", "result"]) == 0
    return {}


@page("planes.md")
def planes(folder, data_dir):
    from experiments.synth.room import corner

    seq = corner(1, seed=0)
    return {"seq": seq, "frame": seq[0]}


@page("primitives.md")
def primitives(folder, data_dir):
    can = st.SDF.cylinder(0.033, 0.102, voxels=60).to_mesh()
    made = st.synth.sequence(can, 4, noise=0.001, clutter="table", seed=1)
    st.save_sequence(folder / "SEQ", made)
    mask = made.masks(0)[0]
    cv2.imwrite(str(folder / "can.png"), 255 * mask.astype(np.uint8))
    np.save(folder / "depth.npy", made[0].depth)
    camera = made.camera.depth
    camera.save(folder / "camera.json")
    points = camera.back_project(made[0].depth)[mask & (made[0].depth > 0)]
    st.Mesh(points, np.zeros((0, 3), int)).save(folder / "CLOUD.ply")
    return {"frame": made[0], "camera": camera, "mask": mask}


@page("reconstruction.md")
def reconstruction(folder, data_dir):
    from reconstruction_scene import first_mask, sequence

    seq = sequence()
    names = {"camera": seq.camera, "frames": list(seq), "mask": first_mask(seq)}
    return names | {"frames2": names["frames"], "mask2": names["mask"]}


@page("sensors.md")
def sensors(folder, data_dir):
    from test_depth_calibration import CAMERA, TRUE, wall

    rng = np.random.default_rng(0)
    for name, distances in (("WALL1", (0.5, 0.7, 0.9)), ("WALL2", (1.2, 1.5, 1.8))):
        made = [wall(TRUE, d, slant, rng) for d in distances for slant in (0, 40)]
        st.save_sequence(folder / name, st.Sequence(made, CAMERA))
    (folder / "recording").rename(folder / "SEQ")
    metres(folder, "M.ply")
    metres(folder, "CUBE.ply")
    return {}


@page("several_objects.md")
def several_objects(folder, data_dir):
    mesh = metres(folder, "sponge.ply")
    made = st.synth.sequence([mesh, mesh], 4, seed=1)
    rest = iter(made[1:])
    T0, T1 = (made.ground_truth[0][k] for k in (0, 1))
    names = {"camera": made.camera, "frame": made[0], "T0": T0, "T1": T1}
    return {"st": st, "next_frame": lambda: next(rest, None), **names}


@page("shape_memory.md")
def shape_memory(folder, data_dir):
    whole = [st.contour.silhouette(st.contour.harmonics(duck(folder)["mask"], 10), (200, 200))] * 3
    return {"whole": whole, "hidden": whole[0]}


@page("starts.md")
def starts(folder, data_dir):
    names = tracker(duck(folder), folder)
    rows, columns = np.nonzero(names["mask"])
    x, y, middle = int(columns.min()), int(rows.min()), len(rows) // 2
    box = {"x": x, "y": y, "w": int(np.ptp(columns)) + 1, "h": int(np.ptp(rows)) + 1}
    return names | box | {"u": int(columns[middle]), "v": int(rows[middle])}


@page("superpixels.md")
def superpixels(folder, data_dir):
    frames = [frame.color for frame in duck(folder)["frames"][:3]]
    cv2.imwrite(str(folder / "photo.jpg"), cv2.cvtColor(frames[0], cv2.COLOR_RGB2BGR))
    return {"frames": frames, "grey": frames[0][..., 1]}


@page("trust.md")
def trust(folder, data_dir):
    class Kalman:
        def update(self, pose, covariance):
            assert np.isfinite(pose).all()
            assert np.isfinite(covariance).all()

    return tracker(duck(folder), folder) | {"kalman": Kalman()}
