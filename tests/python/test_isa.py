# SPDX-License-Identifier: MIT
"""One build, several instruction sets: the same bits from each on any number of threads; a missing one is named."""

import hashlib
import os
import subprocess
import sys

from sdftrack import _core


def run(isa, code, *arguments):
    env = {**os.environ, "SDFTRACK_ISA": isa, "PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], env=env, capture_output=True, text=True, timeout=300
    )


# What every part computes, on as many threads as are asked for.
CALLS = """
import hashlib, sys, numpy as np, sdftrack as st
from sdftrack import _core, synth
n = int(sys.argv[1])
digest = hashlib.sha256()
def tell(*arrays):
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
box = st.SDF.box([0.12, 0.08, 0.05], voxels=80)
mesh = box.to_mesh()
mesh = st.Mesh(mesh.vertices, mesh.faces, np.random.default_rng(0).integers(0, 256, mesh.vertices.shape, np.uint8))
sdf = st.SDF.from_mesh(mesh, voxels=80, threads=n).colored(mesh, threads=n)
camera = st.Camera(262, 262, 159.5, 119.5, 320, 240)
seq = synth.sequence(mesh, 6, noise=0.001, seed=3, camera=camera, clutter="table", threads=1)
T, mask, image = seq.ground_truth[0][0], seq.masks(0)[0], seq[0].color
tell(*_core.zero_mesh(box.values, n, -1), sdf.values, sdf.colors, box.redistanced(threads=n).values)
tell(*sdf.render(camera, T, threads=n), *mesh.raycast(camera, T, threads=n))
for mode in ("depth", "rgbd"):
    for shapes, poses in ((box, [T]), (sdf, [T]), ([box, box], [T, T @ st.geometry.pose(t_m=[0, 0, 0.055])])):
        tracker = st.Tracker(shapes, camera, mode=mode, threads=n)
        tracker.start(seq[0], poses=poses)
        for k in range(1, 6):
            frame = st.Frame(None, seq[k].color) if k == 4 and mode == "rgbd" else seq[k]
            result = tracker.track(frame)
            tell(result.poses, result.covariances)
tracker = st.Tracker(box, camera, threads=n)
found = [tracker.start(seq[0], masks=mask), tracker.track(st.Frame(np.full(camera.shape, 1.5, np.float32)))]
found += [tracker.track(seq[k]) for k in (3, 4, 5)]  # lost, and searched for
tell(*(x for result in found for x in (result.poses, result.runner_up)))
tell(*st.remove_plane(seq[0], camera, threads=n)[1])
for kind in ("sphere", "cylinder", "cone", "box", "ellipsoid", "plane", "auto"):
    for seen in ({"camera": camera, "mask": mask}, {}):
        fit = st.fit_primitive(seq[0] if seen else box.surface_samples(1003)[0], kind, threads=n, **seen)
        tell(fit.T_cam_obj, list(fit.size.values()), fit.covariance)
for warp in ("similarity", "affine"):
    contour = st.contour.ContourTracker(warp=warp)
    contour.start(image, mask=mask)
    for k in range(1, 6):
        tell(contour.track(seq[k].color).phi)
for inputs in (1, 2, 3, 4, 7):
    for diagonal in (False, True):
        x = np.random.default_rng(inputs).uniform(-1, 1, (400, inputs))
        model = st.LWPR(init_D=2, diagonal=diagonal, meta=True, threads=n).update(x, np.sin(3 * x[:, 0]))
        tell(*model.predict(x, confidence=True))
for distance in ("slic", "thesis"):
    for pixels in (image, image.astype(np.float32) / 255):
        tell(st.superpixels.slic(pixels, 300, distance=distance, threads=n))
for form in ({}, {"evidence": "printed"}, {"evolution": "printed"}):
    star = st.Reconstructor(camera, voxels=45, threads=n, **form)
    star.start(seq[0], mask=mask)
    for k in (1, 2):
        tell(star.track(seq[k]).poses, star.shape.values)
    if not form:
        tell(star.resume(seq[5], mask=seq.masks(5)[0]).poses, star.shape.values)
for regulariser in ("double_well", "printed"):
    tell(st.levelset.evolve(box.values, -box.values, 4, box.voxel_size, regulariser=regulariser, threads=n))
print(st.info()["cpu_features_in_use"][0], digest.hexdigest())
"""


def test_the_results_have_the_same_bits_on_every_instruction_set_and_number_of_threads():
    said = {}
    for isa, threads in (*((isa, 1) for isa in _core.isas()), (_core.isas()[-1], 2), (_core.isas()[-1], 5)):
        done = run(isa, CALLS, str(threads))
        assert done.returncode == 0, done.stderr
        used, digest = done.stdout.split()
        assert used == isa
        said[isa, threads] = digest
    assert len(set(said.values())) == 1, said
    assert hashlib.sha256().hexdigest() not in said.values()


def test_an_instruction_set_that_is_not_there_is_named_with_those_that_are():
    done = run("sse9", "import sdftrack")
    assert done.returncode != 0
    assert "SDFTRACK_ISA" in done.stderr
    assert "sse9" in done.stderr
    assert "baseline" in done.stderr
