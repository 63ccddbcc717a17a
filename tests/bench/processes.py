# SPDX-License-Identifier: MIT
"""Time and peak memory of a process that tracks, or one that reconstructs.

    python tests/bench/processes.py track|reconstruct MESH.ply

Counted is the peak resident set of a whole process (Python, numpy, sdftrack), without optional libraries; what it reads
is made by another process. `track`: one volume of 200^3 from a file, 640 x 480 frames, one thread. `reconstruct`: a
turntable (640 x 480, RGB-D, 1 mm noise) frame by frame at 200^3 with default options, once for each number of threads;
the first frame (`start`), the frames of the last two thirds, and the frames that it keeps.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

MAKE = "import sys, sdftrack as st; st.SDF.from_mesh(st.Mesh.load(sys.argv[1]), voxels=200).save(sys.argv[2])"

TRACK = """
import json, resource, sys
import numpy as np
import sdftrack as st
def peak_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
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
import json, resource, sys, time
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
    "peak, MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, "of it kept frames, MB": kept / 2**20,
}))
"""


def measured(code: str, *arguments: str) -> None:
    """Run the code and print its figures."""
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], check=True, capture_output=True, text=True
    )
    for name, value in json.loads(done.stdout).items():
        print(f"  {name:28} {value if isinstance(value, list) else f'{value:.1f}'}", flush=True)


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
            volume = str(Path(folder) / "volume.npz")
            subprocess.run([sys.executable, "-c", MAKE, str(a.mesh), volume], check=True)
            measured(TRACK, volume)
            return 0
        subprocess.run([sys.executable, "-c", RENDER, str(a.mesh), folder, str(a.frames)], check=True)
        for threads in (1, 2):
            print(f"threads: {threads}", flush=True)
            measured(RECONSTRUCT, folder, str(a.frames), str(threads))
    return 0


if __name__ == "__main__":
    sys.exit(main())
