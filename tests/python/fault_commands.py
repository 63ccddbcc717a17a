# SPDX-License-Identifier: MIT
"""Every command that writes, on input of a few frames: what is called, and whether its files are whole."""

import csv
import json
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import sdftrack as st

FRAMES = 4
CAMERA = st.Camera(130.0, 130.0, 79.5, 59.5, 160, 120)


@dataclass(frozen=True)
class Writing:
    """A command.

    Attributes
    ----------
    words : str
        Arguments; {made} is the folder of the inputs. ``--out`` is added.
    name : str
        Of the output within its folder, for a command that writes a file and not a folder.
    grows : bool
        Whether what was recorded before an error or Ctrl-C can be read as a shorter recording.
    improves : bool
        Whether whole files are replaced by better ones before the end.
    """

    words: str
    name: str = ""
    grows: bool = False
    improves: bool = False

    def arguments(self, made: Path, place: Path, *more: str) -> list[str]:
        out = place / (self.name or "out")
        return [*(word.format(made=made) for word in self.words.split()), "--out", str(out), *more]


TRACKED = "{made}/seq --model {made}/box.ply --voxels 24 --threads 1 -q"
COMMANDS = {
    "track": Writing(f"track {TRACKED} --init gt"),
    "reconstruct": Writing(
        "reconstruct {made}/seq --stop 2 --voxels 32 --threads 1 --no-video -q", improves=True
    ),
    "fit": Writing("fit {made}/ball.npy --kind sphere -q"),
    "contour": Writing("contour {made}/images --box 50,30,60,60 -q"),
    "superpixels": Writing("superpixels {made}/images/000000.png --segments 40 -q"),
    "evaluate": Writing("evaluate {made}/tracked {made}/seq -q"),
    "motion": Writing("motion {made}/cup.csv --measures path_length,peak_speed -q"),
    "live": Writing(f"live --camera replay:{TRACKED} --init auto --no-viewer --fps 200 --no-video"),
    "record": Writing("record replay:{made}/seq --fps 200 -q", grows=True),
    "convert": Writing("convert {made}/seq --to tum -q", grows=True),
    "convert to mcap": Writing("convert {made}/seq --to mcap -q", grows=True),
    "synth": Writing("synth --model {made}/box.ply --frames 2 --around none --to tum -q", grows=True),
    "calibrate depth": Writing("calibrate depth {made}/walls -q", name="sensor.toml"),
    "calibrate color": Writing("calibrate color {made}/wand --ball-radius 0.05 --ball-color 225,60,30 -q"),
    "calibrate intrinsics": Writing(
        "calibrate intrinsics {made}/walk --model {made}/box.ply --init gt --free cx,cy --voxels 24 --threads 1 -q"
    ),
    "config": Writing("config -q"),
}


def inputs(base: Path) -> Path:
    """A folder with everything that the commands read, made once for each process that runs tests."""
    made = base / "fault_inputs"
    if not made.exists():
        made.mkdir()
        make_inputs(made)
    return made


def make_inputs(made: Path) -> None:
    from motion_cases import noisy, reaches

    from sdftrack.cli.app import run

    mesh = st.synth.exercise_object("box")
    mesh.save(made / "box.ply")
    path = st.synth.random_walk(step_m=0.002, step_rad=0.01)
    seq = st.synth.sequence(mesh, FRAMES, path, 0.001, seed=2, camera=CAMERA, threads=1)
    st.save_sequence(made / "seq", seq)
    walk = st.synth.sequence(mesh, 12, path, 0.001, seed=2, camera=CAMERA, threads=1)  # as many as it wants
    st.save_sequence(made / "walk", walk)
    tracked = ["track", str(made / "seq"), "--model", str(made / "box.ply"), "--init", "gt", "--voxels", "24"]
    assert run([*tracked, "--out", str(made / "tracked"), "-q", "--no-video"]) == 0
    points = np.random.default_rng(0).normal(size=(400, 3))
    np.save(made / "ball.npy", 0.05 * points / np.linalg.norm(points, axis=1, keepdims=True) + [0, 0, 1])
    times = np.arange(150) / 30
    st.motion.save(made / "cup.csv", noisy(times, reaches(times, [1.0]), name="cup"))
    _images(made / "images")
    _walls(made / "walls")
    wand(made / "wand")


def _images(folder: Path) -> None:
    """A disc that moves, for `contour`."""
    from sdftrack.io.frames import write_color

    folder.mkdir()
    y, x = np.mgrid[:120, :160]
    for i in range(FRAMES):
        disc = np.hypot(x - 80 - i, y - 60) < 25
        image = np.where(disc[..., None], (200, 80, 40), (40, 90, 160)).astype(np.uint8)
        write_color(folder / f"{i:06d}.png", image)


def _walls(folder: Path) -> None:
    """A wall at several distances and angles, for `calibrate depth`."""
    depths = []
    rays = np.dstack([CAMERA.rays, np.ones(CAMERA.shape)])
    rng = np.random.default_rng(4)
    for distance in (0.5, 0.8, 1.2):
        for degrees in (0, 30, 45):
            normal = np.array([np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))])
            depth = distance * normal[2] / (rays @ normal)
            depths.append(depth + 0.001 * rng.standard_normal(depth.shape))
    _recording(folder, CAMERA, depths)


def wand(folder: Path, frames: int = 16) -> None:
    """A ball at the end of a stick, for `calibrate color`."""
    from ball_scenes import DEPTH, recorded

    made = recorded(noise=0.001, seed=0)[1][:frames]
    _recording(folder, DEPTH, [f.depth for f in made], [f.color for f in made])


def _recording(folder: Path, camera: st.Camera, depths: list, colors: list | None = None) -> None:
    """In the layout with camera.json."""
    from sdftrack._internal.files import write_json
    from sdftrack.io.frames import write_color, write_depth_units

    for name in ("depth", "rgb")[: 2 if colors else 1]:
        (folder / name).mkdir(parents=True)
    lens = {name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy")}
    size = [camera.width, camera.height]
    write_json(folder / "camera.json", {"image_size": size, "depth_scale_m": 0.0001, "K_depth": lens})
    for i, depth in enumerate(depths):
        write_depth_units(folder / "depth" / f"{i:06d}.png", np.rint(1e4 * depth).astype(np.uint16))
        if colors:
            write_color(
                folder / "rgb" / f"{i:06d}.png",
                np.ascontiguousarray(np.pad(colors[i], ((0, 10), (0, 10), (0, 0)))),
            )


def final_files(place: Path) -> dict[str, Path]:
    """What has its final name, by its path within the folder; hidden files do not count."""
    return {
        str(path.relative_to(place)): path
        for path in sorted(place.rglob("*"))
        if path.is_file() and not any(part.startswith(".") for part in path.relative_to(place).parts)
    }


def check_readable(path: Path, growing: bool = False) -> None:
    """Raise an error unless a program that knows the format can read the file to its end.

    A recording that is `growing` may lack its index: of a bag, what is whole can be read.
    """
    import av
    import cv2

    data = path.read_bytes()
    assert data, path
    match path.suffix:
        case ".json":
            json.loads(data)
        case ".toml":
            tomllib.loads(data.decode())
        case ".csv":
            assert data.endswith(b"\n"), path
            assert len({len(row) for row in csv.reader(data.decode().splitlines())}) == 1, path
        case ".txt" | ".md":
            assert data.endswith(b"\n"), path
        case ".png" | ".jpg":
            assert cv2.imread(str(path), cv2.IMREAD_UNCHANGED) is not None, path
            assert data.endswith(b"IEND\xaeB`\x82" if path.suffix == ".png" else b"\xff\xd9"), path
        case ".mp4":
            with av.open(str(path)) as video:
                assert sum(1 for _ in video.decode(video=0)) > 0
        case ".npz" | ".npy":
            np.load(path)
        case ".ply" | ".obj":
            st.Mesh.load(path)
        case ".html":
            assert data.rstrip().endswith(b"</html>"), path
        case ".svg":
            assert data.rstrip().endswith(b"</svg>"), path
        case ".mcap":
            assert data.startswith(b"\x89MCAP0\r\n"), path
            assert growing or data.endswith(b"\x89MCAP0\r\n"), path
        case ".glb":
            assert int.from_bytes(data[8:12], "little") == len(data), path
        case ".yaml":  # of a ROS 2 bag
            assert data.startswith(b"rosbag2_bagfile_information:"), path
            assert data.endswith(b"\n"), path
        case other:
            raise AssertionError(f"{path}: how is {other} read?")
