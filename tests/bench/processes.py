# SPDX-License-Identifier: MIT
"""Time and peak memory of a process that tracks, or one that reconstructs.

    python tests/bench/processes.py track|reconstruct MESH.ply

Counted is the peak resident set of a whole process (Python, numpy, sdftrack), without optional libraries, as Linux
keeps it for a program (getrusage includes what its parent had before); what it reads is made by another process.
`track`: one volume of 200^3 from a file, 640 x 480 frames, one thread. `reconstruct`: a turntable (640 x 480, RGB-D,
1 mm noise) frame by frame at 200^3 with default options, once for each number of threads; the first frame (`start`),
the frames of the last two thirds, and the frames that it keeps.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

MAKE = "import sys, sdftrack as st; st.SDF.from_mesh(st.Mesh.load(sys.argv[1]), voxels=200).save(sys.argv[2])"

TRACK = """
import json, sys
import numpy as np
import sdftrack as st
def peak_mb():
    return int(open('/proc/self/status').read().split('VmHWM:')[1].split()[0]) / 1024
figures = {"imports, MB": peak_mb()}
shape = st.SDF.load(sys.argv[1])
figures["with the volume, MB"] = peak_mb()
camera = st.Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
pose = np.eye(4)
pose[2, 3] = 0.8
depth, _ = shape.render(camera, pose)
rng = np.random.default_rng(0)
tracker = st.Tracker(shape, camera, threads=1)
for i in range(60):
    noisy = np.where(depth > 0, depth + rng.normal(0, 0.001, depth.shape), 0).astype(np.float32)
    result = tracker.track(noisy) if i else tracker.start(st.Frame(noisy), poses=[pose])
    assert result.ok, result
figures["while tracking, MB"] = peak_mb()
figures["optional libraries loaded"] = sorted({"matplotlib", "cv2", "scipy", "trimesh"} & set(sys.modules))
print(json.dumps(figures))
"""

RENDER = """
import sys
from pathlib import Path
import numpy as np
import sdftrack as st
from sdftrack.synth.trajectories import orbit
mesh, folder, n = st.Mesh.load(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
path = orbit(distance_m=0.7, turns=1.0, elevation_rad=0.5)
sequence = st.synth.sequence(mesh, n, path, 0.001, clutter="wall", seed=1)
with (folder / "depth").open("wb") as depth, (folder / "color").open("wb") as color:
    for i in range(n):
        sequence[i].depth.tofile(depth)
        sequence[i].color.tofile(color)
sequence.masks(0)[0].tofile(folder / "mask")
"""

RECONSTRUCT = """
import json, sys, time
from pathlib import Path
import numpy as np
import sdftrack as st
folder, n, threads = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
depth, color = (folder / "depth").open("rb"), (folder / "color").open("rb")
def frame(i):
    d = np.fromfile(depth, np.float32, 640 * 480).reshape(480, 640)
    return st.Frame(d, np.fromfile(color, np.uint8, 640 * 480 * 3).reshape(480, 640, 3), timestamp=i / 30)
star = st.Reconstructor(st.Camera(525.0, 525.0, 319.5, 239.5, 640, 480), threads=threads)
times = []
for i in range(n):
    now = frame(i)
    begin = time.perf_counter()
    if i == 0:
        star.start(now, mask=np.fromfile(folder / "mask", bool).reshape(480, 640))
    else:
        assert star.track(now).ok
    times.append(1e3 * (time.perf_counter() - begin))
lower, median, upper = np.percentile(times[n // 3:], [25, 50, 75])
kept = sum(x.nbytes for s in star._kept for x in (s.depth, s.rgb, s.foreground))
print(json.dumps({
    "first frame, ms": times[0], "steady, ms": median, "quartiles, ms": (round(lower, 1), round(upper, 1)),
    "mean of the first third, ms": np.mean(times[1:n // 3]),
    "peak, MB": int(open("/proc/self/status").read().split("VmHWM:")[1].split()[0]) / 1024,
    "of it kept frames, MB": kept / 2**20,
}))
"""


IMPORT = """
import json, time
begin = time.process_time()
import sdftrack
imported = time.process_time()
sdftrack.Tracker
print(json.dumps({"processor time, ms": 1e3 * (imported - begin),
                  "with Tracker, ms": 1e3 * (time.process_time() - begin)}))
"""


def figures(code: str, *arguments: object) -> dict[str, Any]:
    """What a process that runs the code prints of itself."""
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return dict(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))


def import_figures() -> dict[str, Any]:
    return figures(IMPORT)


def track_figures(mesh: Path, folder: str) -> dict[str, Any]:
    volume = str(Path(folder) / "volume.npz")
    subprocess.run([sys.executable, "-c", MAKE, str(mesh), volume], check=True)
    return figures(TRACK, volume)


def render(mesh: Path, folder: str, frames: int) -> None:
    subprocess.run([sys.executable, "-c", RENDER, str(mesh), folder, str(frames)], check=True)


def reconstruct_figures(folder: str, frames: int, threads: int) -> dict[str, Any]:
    return figures(RECONSTRUCT, folder, frames, threads)


def show(of_it: dict[str, Any]) -> None:
    for name, value in of_it.items():
        print(f"  {name:28} {f'{value:.1f}' if isinstance(value, float) else value}", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("track", "reconstruct"))
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--frames", type=int, default=300, help="to reconstruct from")
    a = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if a.what == "track":
            show(track_figures(a.mesh, folder))
            return 0
        render(a.mesh, folder, a.frames)
        for threads in (1, 2):
            print(f"threads: {threads}", flush=True)
            show(reconstruct_figures(folder, a.frames, threads))
    return 0


if __name__ == "__main__":
    sys.exit(main())
