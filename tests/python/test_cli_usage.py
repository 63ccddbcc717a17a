# SPDX-License-Identifier: MIT
"""Wrong usage (2) and bad input (1) of every command: one line says what was expected, and nothing is left behind."""

import json

import cv2
import numpy as np
import pytest
import trimesh
from motion_cases import noisy, reaches
from refusals import error_line
from tracking_scene import box_mesh

import sdftrack as st
from sdftrack import motion
from sdftrack.cli.app import as_options, options_of, parser, run

CAMERA = st.Camera(150.0, 150.0, 79.5, 59.5, 160, 120)
TIMES = np.arange(300) / 30

# Exit code | command line | part of the message. The files are those of `data`.
TABLE = """
2 | track | Missing argument
2 | track seq | Missing option '--model'
2 | track seq --model m.ply | expected a folder for the results: --out DIR
2 | track seq --model m.ply -o o --mode sonar | --mode: expected one of auto, depth, rgbd, rgb, got 'sonar'
2 | track seq --model m.ply -o o --init guess | expected gt, auto, mask, poses.json
2 | track seq --model m.ply -o o --init box:1,2,3 | expected box:x,y,w,h
2 | track seq --model m.ply -o o --init box:1,2,0,4 | a width and a height above 0
2 | track seq --model m.ply -o o --init click:nan,1 | expected click:x,y
2 | track seq --model m.ply -o o --init gt --init auto | expected only gt
2 | track seq --model m.ply -o o --init box:1,2,3,4 --init box:1,2,3,4 | one mask, box or click per --model (1), got 2
2 | track seq --model m.ply --model m.ply -o o --init mask.png | one mask, box or click per --model (2), got 1
2 | track seq --model m.ply --model m.ply -o o --init mask.png --init box:1,2,3,4 | only boxes, or masks and clicks
2 | track seq --model m.ply -o o --count 2 --count 3 | --count: expected one per --model (1), got 2
2 | track seq --model m.ply -o o --overlay-mesh m.ply --overlay-mesh m.ply | at most one per --model (1)
2 | track seq --model m.ply -o o --mode depth --outline | --outline: expected --mode rgbd, rgb or auto
2 | track seq --model m.ply -o o --mode rgb --no-outline | --no-outline: expected --outline
2 | track seq --model m.ply -o o --mode rgb --init auto | --init: expected gt or a file of poses
2 | track seq --model m.ply -o o --symmetry always | expected auto, none or a models_info.json
2 | track seq --model m.ply -o o --init box:400,10,30,30 | 160 x 120
2 | track seq --model m.ply -o o --modell m.ply | unknown option '--modell'; did you mean '--model'?
1 | track /nowhere --model m.ply -o o | no such folder
1 | track seq --model none.ply -o o | none.ply
1 | track seq --model m.ply -o seq | expected another folder than the sequence
1 | track seq --model m.ply -o o --start 9 | --start, --stop: expected some of the 4 frames
1 | track seq --model m.ply -o o --init none.png | --init none.png: the file is missing
1 | track seq --model m.ply -o o --init small.png | geometry of the depth image
1 | track seq --model m.ply -o o --init empty.png | empty
1 | track bare --model m.ply -o o | --init auto
1 | track seq --model m.ply -o o --init other.json | T_cam_obj
1 | track seq --model m.ply -o o --init few.json | one 4x4 matrix per --model (1), got 0
1 | track seq --model m.ply -o o --init scaled.json | rigid
1 | track seq --model m.ply -o o --init behind.json | behind the camera
1 | track seq --model m.ply -o o --init far.json | metres, are these mm
1 | track seq --model huge.ply -o o | mm
1 | track seq --model m.ply --unit mm -o o | 0.00012 m
1 | track seq --model open.ply -o o | --holes close
1 | track seq --model plate.ply --voxels 60 -o o | --voxels
1 | track seq --model foil.ply --voxels 60 -o o | thicken
1 | fit millimetres.npy --kind sphere -o o | are they in mm? pass --unit mm
1 | info --config /nowhere.toml | no such file
2 | config extra | extra
2 | reconstruct seq -o o --init click:3,4 | box:x,y,w,h
2 | reconstruct seq -o o --init gt | --shape
2 | reconstruct seq -o o --shape sphere:big | sphere:RADIUS
2 | reconstruct seq -o o --shape sphere:80 | metres
2 | reconstruct seq -o o --extent -1 | --extent: expected metres above 0 and up to 10, got -1
2 | reconstruct seq -o o --format ply,dwg | ply, obj
2 | reconstruct seq -o o --quality fine --voxels 64 | one of --quality and --voxels
2 | reconstruct seq seq -o o --then bare | --then: expected one SEQ
2 | reconstruct seq -o o --then-init mask | --then-init: expected one for each --then
2 | reconstruct seq -o o --then bare --then-init gt | --then-init: expected box:x,y,w,h, mask.png, mask, got 'gt'
2 | reconstruct seq -o o --then bare --evolution printed | supports only one recording
2 | reconstruct bare -o o | no mask
2 | reconstruct seq -o o --object 4 | --object
2 | reconstruct seq -o o --then bare | no mask
2 | reconstruct bare -o o --init gt --shape sphere:0.1 | no ground truth
1 | reconstruct seq -o o --config kept_frame.toml | did you mean 'kept_frames'
1 | reconstruct seq -o o --config alone.toml | unknown option 'kept_frames'
2 | calibrate color seq --ball-radius 0.05 -o o --ball-color 1,2,400 | expected r,g,b
2 | calibrate color seq --ball-radius -1 -o o | --ball-radius: expected metres above 0, got -1
1 | calibrate color k1 --ball-radius 0.05 -o k1 --overwrite | SEQ: expected no file that would be replaced
2 | calibrate intrinsics seq --model m.ply -o o --free fx,fx | each once
1 | calibrate intrinsics seq --model m.ply -o o --camera large.json | 160 x 120, got 640 x 480
1 | calibrate intrinsics seq --model m.ply -o o --init gt -q | at least 5
2 | calibrate depth seq | --out sensor.toml
2 | calibrate depth seq -o large.json | expected a new file, got large.json
2 | calibrate depth seq -o small.toml | expected a new file, got small.png
2 | fit empty.png -o o | give its intrinsics by --camera FILE or --intrinsics
2 | fit empty.png -o o --intrinsics 500,500,3 | expected fx,fy,cx,cy in pixels
2 | fit empty.png -o o --intrinsics 500,500,3,3 --camera c.json | got both
1 | fit depth.png -o o --camera nowhere.json | no such camera file
2 | fit depth.png -o o --intrinsics 500,500,3,3 --unit mm | expected --depth-scale
1 | fit empty.png -o o --intrinsics 500,500,3,3 | expected 16-bit depth in one channel
1 | fit cube.npy -o o --intrinsics 500,500,3,3 | expected depth (H, W) or points (N, 3)
2 | fit clouds/primitive.ply -o o --intrinsics 500,500,3,3 | expected a depth image
2 | fit clouds/primitive.ply -o o --frame 1 --start 1 | --frame
1 | fit objects.npy -o o | not a readable .npy file
1 | fit flat.npy -o o | expected points x, y, z of shape (N, 3)
1 | fit empty.xyz -o o | expected points, got none
1 | fit words.xyz -o o | line 1: expected x y z, got 'hello world foo'
1 | fit torn.ply -o o | truncated: its header states 400 lines of data, found 200
1 | fit clouds/primitive.ply -o clouds --overwrite | expected no file that would be replaced
2 | contour rgb -o o | expected --box or --mask, got none
2 | contour rgb -o o --box 1,2,3 | --box: expected x,y,w,h in pixels, w and h above 0
2 | contour rgb -o o --box 60,40,40,40 --memory-file m.shapes | --memory-file: expected --memory with it
1 | contour rgb -o o --box 500,2,30,30 | box: expected a box in the 160 x 120 image
1 | contour film.mp4 -o o --box 1,2,30,40 | not a readable video
1 | contour nothing -o o --box 1,2,30,40 | folder of images
1 | contour rgb -o o --box 1,2,30,40 --config softnes.toml | [contour] unknown option 'softnes'; did you mean
1 | contour rgb -o o --box 1,2,30,40 --config pixels.toml | expected options in a table [contour], got none
1 | contour rgb -o o --box 1,2,30,40 --config contours.toml | did you mean [contour]?
2 | superpixels text.png -o o --segments 0 | --segments
1 | superpixels text.png -o o | IMAGE text.png: not a readable image
1 | superpixels images/mean.png --segments 40 -o images --overwrite | IMAGE: expected no file that would be replaced
2 | motion cup.csv -o o --measures beauty | path_length
2 | motion cup.csv -o o --up 0,0,0 | --up
2 | motion cup.csv -o o --cues soon | --cues
2 | motion cup.csv -o o --session a --session b | --session
2 | motion cup.csv cup.csv -o o --repetitions r.json | --repetitions
1 | motion cup.csv -o o --repetitions late.json | within the recording of cup, 0 to 9.96667 s, got 8 to 99 s
1 | motion cup.csv -o o --repetitions over.json | one after another
1 | motion cup.csv -o o --repetitions cut.json | expected a repetitions.json
1 | convert seq --to mcap --color video -o o | holds images one by one
1 | convert seq -o seq | expected another folder than the sequence
1 | convert seq --resume -o o | holds no interrupted recording
2 | record webcam:0 -o o | live --camera webcam:0 follows an outline (--contour)
2 | synth --noise loud -o o | standard deviation in metres
2 | synth --kind reach -o o | the scene 'sequence' does not use this option
2 | synth exercise --object cup --model m.ply -o o | --object
1 | synth exercise --model m.ply --model m.ply -o o | expected 1
2 | view seq --seconds -1 | --seconds
1 | batch nowhere.toml -o o | nowhere.toml: no such file
1 | batch status nowhere | expected the folder of a batch
2 | batch status | sdftrack batch status DIR
2 | batch a.toml b.toml | expected one plan, got 2
2 | batch a.toml --scheduler tcp://x:1 --jobs 2 | one of --scheduler and --jobs
2 | live -o o | expected either --model
2 | live --reconstruct --no-viewer | nobody can show the object
2 | live --reconstruct --init auto | with --reconstruct, got auto
2 | live --reconstruct --mode rgb | a reconstruction needs depth
2 | live --reconstruct --camera webcam:0 | cannot be reconstructed from colour alone
2 | live --model m.ply --init gt | expected auto
2 | live --model m.ply --camera webcam:0 | expected a file of start poses, --init poses.json
2 | live --model m.ply --camera webcam:0 --mode depth | a webcam has colour alone, and mode depth needs depth
2 | live --model m.ply --camera replay:seq --intrinsics large.json | other cameras know their
2 | live --contour --mode rgb | expected no --mode with --contour
2 | live --contour --stream ws://localhost:0 | an outline has no pose to send
1 | live --contour --config nothing.toml | expected options in a table [contour]
2 | live --contour --camera replay:seq --no-viewer --init box:400,9,9,9 -q | in the 160 x 120 colour image
1 | live --contour --camera replay:seq --no-viewer --init small.png -q | the colour image's size 160 x 120, got 9 x 7
"""
ROWS = [[cell.strip() for cell in line.split(" | ", 2)] for line in TABLE.strip().splitlines()]
OPTIONS = {
    "nothing": "", "kept_frame": "[reconstruct]\nkept_frame = 3", "alone": "kept_frames = 3",
    "softnes": "[contour]\nsoftnes = 1", "pixels": "[tracker]\nmax_pixels = 2000", "contours": "[contours]\nbins = 16",
}  # fmt: skip
POSES = {
    "other": {"poses": []}, "few": {"T_cam_obj": []},
    "scaled": {"T_cam_obj": [(2 * np.eye(4)).tolist()]},
    "behind": {"T_cam_obj": [st.geometry.pose(t_m=(0, 0, -0.5)).tolist()]},
    "far": {"T_cam_obj": [st.geometry.pose(t_m=(10, 20, 500)).tolist()]},
    "late": [[1, 3], [8, 99]], "over": [[1, 4], [3, 5]],
}  # fmt: skip

CLOUDS = {"empty.xyz": "", "words.xyz": "hello world foo\n"}
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 400\n"
    + "".join(f"property float {c}\n" for c in "xyz")
    + "end_header\n"
)


def ball():
    """Points on a sphere of 50 mm before the camera."""
    v = np.random.default_rng(0).normal(size=(400, 3))
    return 0.05 * v / np.linalg.norm(v, axis=1, keepdims=True) + [0, 0, 1]


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """A recording with masks, truth and a model, one of depth alone, images, a trajectory, and bad files."""
    root = tmp_path_factory.mktemp("data")
    mesh = st.SDF.box((0.12, 0.09, 0.06), voxels=40).to_mesh()
    mesh.save(root / "m.ply")
    st.Mesh(1e3 * mesh.vertices * [1, 1, 1.1], mesh.faces).save(root / "huge.ply")
    st.Mesh(mesh.vertices, mesh.faces[:-1]).save(root / "open.ply")
    for name, thin in (("plate", 0.003), ("foil", 0.0003)):
        box_mesh((0.2, 0.2, thin)).save(root / f"{name}.ply")
    seq = st.synth.sequence(mesh, 4, camera=CAMERA, noise=0.001, clutter="wall", seed=5)
    st.save_sequence(root / "seq", seq, layout="bop")
    st.save_sequence(
        root / "bare", st.Sequence([f.replace(color=None) for f in seq[:2]], CAMERA), layout="bop"
    )
    (root / "rgb").mkdir()
    for k, frame in enumerate(seq):
        cv2.imwrite(str(root / "rgb" / f"{k}.png"), frame.color[..., ::-1])
    (root / "nothing").mkdir()
    (root / "images").mkdir()
    cv2.imwrite(str(root / "images" / "mean.png"), seq[0].color)
    (root / "clouds").mkdir()
    trimesh.PointCloud(mesh.vertices).export(root / "clouds" / "primitive.ply")
    (root / "k1").mkdir()
    (root / "k1" / "camera.json").write_text("{}")
    cv2.imwrite(str(root / "small.png"), np.full((7, 9), 255, np.uint8))
    cv2.imwrite(str(root / "empty.png"), np.zeros((120, 160), np.uint8))
    cv2.imwrite(str(root / "depth.png"), np.full((120, 160), 800, np.uint16))
    for name in ("text.png", "film.mp4"):
        (root / name).write_text("neither")
    points = np.random.default_rng(0).normal(size=(400, 3))
    np.save(root / "millimetres.npy", 1e3 * ball())
    for name, array in (("cube", np.zeros((4, 5, 6))), ("flat", points.ravel()), ("objects", np.array([{}]))):
        np.save(root / f"{name}.npy", array, allow_pickle=True)
    torn = "".join(f"{x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in points[:200])
    for name, text in {**CLOUDS, "torn.ply": f"{PLY}{torn}"}.items():
        (root / name).write_text(text)
    st.Camera(600.0, 600.0, 300.0, 200.0, 640, 480).save(root / "large.json")
    for name, text in OPTIONS.items():
        (root / f"{name}.toml").write_text(f"{text}\n")
    for name, value in POSES.items():
        (root / f"{name}.json").write_text(json.dumps(value))
    (root / "cut.json").write_text("[1, 2")
    motion.save(root / "cup.csv", noisy(TIMES, reaches(TIMES, (1.0, 4.0, 7.0)), name="cup"))
    return root


@pytest.mark.parametrize(("code", "line", "message"), ROWS, ids=[line for _, line, _ in ROWS])
def test_wrong_usage_and_bad_input_are_one_line_and_leave_nothing(
    data, monkeypatch, capsys, code, line, message
):
    monkeypatch.chdir(data)
    before = sorted(data.rglob("*"))
    assert run(line.split()) == int(code)
    error = error_line(capsys)
    assert message in error
    assert (code == "2") == ("--help" in error)
    assert sorted(data.rglob("*")) == before


@pytest.mark.parametrize("separator", [",", ", ", ";", "\t"])
def test_coordinates_may_be_parted_by_commas(tmp_path, separator):
    path = tmp_path / "cloud.xyz"
    path.write_text("# x y z\n" + "\n".join(separator.join(f"{c:.6f}" for c in p) for p in 1e3 * ball()))
    words = ["--kind", "sphere", "--unit", "mm", "--out", str(tmp_path / "out"), "-q"]
    assert run(["fit", str(path), *words]) == 0
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    assert found["size"]["radius"] == pytest.approx(0.05, abs=1e-4)


@pytest.mark.parametrize(
    ("python", "shell"),
    [
        ("pass unit='mm'", "pass --unit mm"),
        ("or colour is late (time_offset=True)", "or colour is late (--time-offset)"),
        ("ball_color: grey; paint the ball, or pass mask_fn=", "--ball-color: grey; paint the ball"),
        ("move the ball, or pass color_camera=", "move the ball, or pass --color-camera"),
        ("pass ball_color=(r, g, b) or mask_fn=", "pass --ball-color r,g,b"),
        ("leave them out (points[np.isfinite(points).all(axis=1)])", "leave them out"),
        ("holds files; pass overwrite=True", "holds files; pass --overwrite"),
        ("fx=500 is far", "fx=500 is far"),
    ],
)  # fmt: skip
def test_advice_is_in_options_and_what_has_none_is_left_out(python, shell):
    assert as_options(python, options_of(parser(), ["calibrate", "color", "SEQ"])) == shell
