# SPDX-License-Identifier: MIT
"""Single files: meshes, trajectories, cameras, options, start poses, images."""

import dataclasses
import json
import random
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_files import file_case, file_cases, repaired_png
from fuzz_targets import Case, Target

import sdftrack as st
from sdftrack import _core

CAMERA = st.Camera(60.0, 61.0, 31.0, 23.5, 64, 48)


def poses(count: int) -> list[np.ndarray]:
    return [st.geometry.pose([0.1 * i, 0.2, -0.3], [0.01 * i, 0.02, 0.8]) for i in range(count)]


def written(folder: Path, name: str, write: Any) -> bytes:
    path = folder / f"seed_{name}"
    write(path)
    return path.read_bytes()


def _meshes(folder: Path) -> Case:
    ball = st.SDF.sphere(0.05, voxels=9).to_mesh()
    colors = np.random.default_rng(0).integers(0, 256, (len(ball.vertices), 3), np.uint8)
    mesh = st.Mesh(ball.vertices, ball.faces, colors)
    text = (
        b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        + (
            b"element face 4\nproperty list uchar int vertex_indices\nend_header\n"
            b"0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
        )
    )
    seeds = {f"mesh.{kind}": written(folder, f"m.{kind}", mesh.save) for kind in ("ply", "obj", "glb")}
    seeds["mesh.stl"] = mesh.to_trimesh().export(file_type="stl")
    seeds["text.stl"] = mesh.to_trimesh().export(file_type="stl_ascii").encode()
    seeds["text.ply"] = text
    return file_case(folder, seeds, st.Mesh.load, suffixes=(".ply", ".obj", ".stl", ".glb"))


def _trajectories(folder: Path) -> Case:
    from sdftrack.io import report_file as trajectories

    times, T = np.arange(8) / 30, np.array(poses(8))
    tum = "".join(f"{trajectories.tum_line(t, P)}\n" for t, P in zip(times, T, strict=True)).encode()
    log = "\n".join(line for i, P in enumerate(T) for line in trajectories.log_lines(i, P)).encode()
    moved = st.motion.Trajectory(times, T, np.tile(1e-6 * np.eye(6), (8, 1, 1)))
    table = written(folder, "a.csv", lambda p: st.motion.save(p, moved))
    bop = "scene_id,im_id,obj_id,score,R,t,time\n" + "".join(
        f"1,{i},3,1.0,{' '.join(map(str, P[:3, :3].ravel()))},{' '.join(map(str, 1e3 * P[:3, 3]))},-1\n"
        for i, P in enumerate(T)
    )
    load = {"a.txt": tum, "a.csv": table, "bop.csv": bop.encode()}
    return file_cases(
        folder,
        (load, lambda p: st.motion.load(p, fps=30 if p.name.startswith("bop") else None)),
        (load, lambda p: st.motion.load(p, fps=25)),
        ({"a.txt": tum}, trajectories.read_tum),
        ({"a.log": log}, trajectories.read_log),
    )


def _c3d(folder: Path) -> Case:
    moved = st.motion.Trajectory(np.arange(6) / 30, np.array(poses(6)))
    seeds = {
        "a.c3d": written(folder, "a.c3d", lambda p: st.motion.save(p, moved)),
        "b.c3d": written(
            folder, "b.c3d", lambda p: st.motion.save(p, [moved, dataclasses.replace(moved, name="b")])
        ),
    }
    return file_case(folder, seeds, st.motion.load)


def _cameras(folder: Path) -> Case:
    fields = {"fx": 60.0, "fy": 61.0, "cx": 31, "cy": 23.5, "width": 64, "height": 48}
    seeds: dict[str, Any] = {
        "camera.json": {**fields, "distortion": [0.1, -0.2, 0.001, 0.002, 0.05]},
        "open3d.json": {"width": 64, "height": 48, "intrinsic_matrix": [60, 0, 0, 0, 61, 0, 31, 23, 1]},
        "k1.json": {"K_depth": fields, "image_size": [64, 48]},
    }
    data = {name: json.dumps(value).encode() for name, value in seeds.items()}
    data["ros.yaml"] = (
        b"image_width: 64\nimage_height: 48\ncamera_name: c\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
        b"  data: [60, 0, 31, 0, 61, 23, 0, 0, 1]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n"
        b"  rows: 1\n  cols: 5\n  data: [0.1, -0.2, 0.001, 0.002, 0]\n"
    )
    matrix = {"K.txt": b"60 0 31\n0 61 23\n0 0 1\n"}
    return file_cases(folder, (data, st.Camera.load), (matrix, lambda p: st.Camera.load(p, 64, 48)))


def _options(folder: Path) -> Case:
    from sdftrack._internal.option_files import options_from_file
    from sdftrack.cli.init import read_poses
    from sdftrack.reconstruction import ReconstructorOptions

    tables = (
        b"[tracker]\nnoise_m = 0.002\nadapt_noise = false\nresidual = 'ray_hit'\n[reconstruct]\n[contour]\n"
    )
    flat = b"noise_m = 0.002\nscale_start_m = 0.01\n"
    sensor = written(folder, "s.toml", st.SensorModel.preset("kinect_v1").save)
    sensor_json = written(folder, "s.json", st.SensorModel.preset("kinect_v1").save)
    start = json.dumps({"T_cam_obj": [T.tolist() for T in poses(2)]}).encode()
    return file_cases(
        folder,
        ({"a.toml": tables, "b.toml": flat}, st.TrackerOptions.from_file),
        ({"a.toml": tables}, ReconstructorOptions.from_file),
        ({"a.toml": tables}, lambda p: options_from_file(_core.ContourOptions, p, "contour")),
        ({"a.toml": sensor, "a.json": sensor_json}, lambda p: st.SensorModel.of(str(p))),
        ({"a.json": start}, lambda p: read_poses(p, 2)),
    )


def image_seeds() -> dict[str, bytes]:
    """Small images of each kind."""
    import cv2

    rng = np.random.default_rng(0)
    color = rng.integers(0, 256, (48, 64, 3), np.uint8)
    depth = rng.integers(700, 900, (48, 64)).astype(np.uint16)
    seeds = {f"c{kind}": color for kind in (".png", ".jpg", ".tif", ".bmp", ".ppm")}
    seeds |= {
        "d.png": depth,
        "d.tif": depth,
        "d.pgm": depth,
        "g.jpg": color[..., 0],
        "a.png": np.dstack([color, color[..., 0]]),
    }
    return {name: cv2.imencode(Path(name).suffix, image)[1].tobytes() for name, image in seeds.items()}


def repair_image(rng: random.Random, data: bytes) -> bytes:
    return repaired_png(data) if data.startswith(b"\x89PNG") else data


def _images(folder: Path) -> Case:
    from sdftrack.io import frames

    seeds = image_seeds()
    depth = {name: data for name, data in seeds.items() if name.startswith("d")}
    color = {name: data for name, data in seeds.items() if not name.startswith("d")}
    readers = (depth, frames.read_depth_units), (color, frames.read_color), (seeds, frames.read_mask)
    return file_cases(folder, *readers, repair=repair_image)


TARGETS = (
    Target("meshes", _meshes, weight=0.5),
    Target("trajectories", _trajectories),
    Target("c3d", _c3d, weight=0.05, needs=("ezc3d",)),
    Target("cameras", _cameras),
    Target("options", _options),
    Target("images", _images),
)
