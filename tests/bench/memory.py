# SPDX-License-Identifier: MIT
"""Peak memory of a process that tracks: ``python tests/bench/memory.py MESH.ply``.

Counted is the peak resident set of a whole process (Python, numpy, sdftrack, one volume of 200^3 and its preparation,
640 x 480 frames, one thread), without matplotlib, OpenCV or another optional library. The volume is made by another
process and read from a file, as one would who tracks the same object every day; the mesh is needed for that alone.
"""

from __future__ import annotations

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
figures = {"imports": peak_mb()}
shape = st.SDF.load(sys.argv[1])
figures["with the volume"] = peak_mb()
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
figures["while tracking"] = peak_mb()
figures["optional libraries loaded"] = sorted({"matplotlib", "cv2", "scipy", "trimesh"} & set(sys.modules))
print(json.dumps(figures))
"""


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("mesh", type=Path)
    a = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        volume = str(Path(folder) / "volume.npz")
        subprocess.run([sys.executable, "-c", MAKE, str(a.mesh), volume], check=True)
        done = subprocess.run(
            [sys.executable, "-c", TRACK, volume], check=True, capture_output=True, text=True
        )
    for name, value in json.loads(done.stdout).items():
        print(f"{name:28} {value if isinstance(value, list) else f'{value:.0f} MB'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
