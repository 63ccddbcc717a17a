# SPDX-License-Identifier: MIT
"""One build, several instruction sets: the same bits from each, and a clear error for one that is not there."""

import hashlib
import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

import sdftrack as st
from sdftrack import _core


def run(isa, code):
    env = {**os.environ, "SDFTRACK_ISA": isa, "PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=120)


CALLS = """
import hashlib, numpy as np, sdftrack as st
from sdftrack import synth
sdf = st.SDF.box([0.12, 0.08, 0.05], voxels=80)
seq = synth.sequence(sdf, 6, noise=0.001, seed=3, camera=st.Camera(262, 262, 159.5, 119.5, 320, 240))
digest = hashlib.sha256()
for mode in ("depth", "rgbd"):
    tracker = st.Tracker(sdf, seq.camera, mode=mode, threads=1)
    tracker.start(seq[0], poses=[seq.ground_truth[0][0]])
    for k in range(1, 6):
        result = tracker.track(seq[k])
        digest.update(result.poses.tobytes() + result.covariance.tobytes())
digest.update(tracker.start(seq[0], masks=seq.masks(0)[0]).poses.tobytes())
for kind in ("sphere", "cylinder", "cone", "box", "ellipsoid", "plane"):
    for seen in ({"camera": seq.camera, "mask": seq.masks(0)[0]}, {}):
        fit = st.fit_primitive(seq[0] if seen else sdf.surface_samples(1003)[0], kind, **seen)
        digest.update(np.array([*fit.T_cam_obj.ravel(), *fit.size.values(), *fit.covariance.ravel()]).tobytes())
for warp in ("similarity", "affine"):
    contour = st.contour.ContourTracker(warp=warp)
    contour.start(seq[0].color, mask=seq.masks(0)[0])
    for k in range(1, 6):
        digest.update(contour.track(seq[k].color).phi.tobytes())
for n in (1, 2, 3, 4, 7):
    for diagonal in (False, True):
        x = np.random.default_rng(n).uniform(-1, 1, (400, n))
        model = st.LWPR(init_D=8, diagonal=diagonal, meta=True).update(x, np.sin(3 * x[:, 0]))
        digest.update(np.concatenate(model.predict(x, confidence=True)).tobytes())
for distance in ("slic", "thesis"):
    for image in (seq[0].color, seq[0].color.astype(np.float32) / 255):
        digest.update(st.superpixels.slic(image, 300, distance=distance).tobytes())
for form in ("smooth", "printed"):
    star = st.Reconstructor(seq.camera, voxels=45, threads=1, evidence=form)
    star.start(seq[0], mask=seq.masks(0)[0])
    star.track(seq[1])
    digest.update(star.shape.values.tobytes())
for regulariser in ("double_well", "printed"):
    digest.update(st.levelset.evolve(sdf.values, -sdf.values, 4, sdf.voxel_size, regulariser=regulariser).tobytes())
print(st.info()["cpu_features_in_use"][0], digest.hexdigest())
"""


def test_the_results_have_the_same_bits_on_every_instruction_set():
    said = {}
    for isa in _core.isas():
        done = run(isa, CALLS)
        assert done.returncode == 0, done.stderr
        used, digest = done.stdout.split()
        assert used == isa
        said[isa] = digest
    assert len(set(said.values())) == 1, said
    assert hashlib.sha256().hexdigest() not in said.values()


def test_an_instruction_set_that_is_not_there_is_named_with_those_that_are():
    done = run("sse9", "import sdftrack")
    assert done.returncode != 0
    assert "SDFTRACK_ISA" in done.stderr
    assert "sse9" in done.stderr
    assert "baseline" in done.stderr


@pytest.mark.skipif("SDFTRACK_ISA" in os.environ, reason="one is forced")
def test_the_fastest_is_used_unless_told_otherwise():
    assert st.info()["cpu_features_in_use"] == [_core.isas()[-1]]
    assert _core.isas()[0] == "baseline"


CPUINFO = Path("/proc/cpuinfo")
NEEDS = {"avx2": {"avx2"}, "avx512": {"avx2", "avx512f", "avx512dq", "avx512bw", "avx512vl"}}


@pytest.mark.skipif(platform.machine() != "x86_64" or not CPUINFO.exists(), reason="flags of x86-64 by Linux")
def test_every_instruction_set_that_the_processor_has_is_offered():
    flags = set(next(line for line in CPUINFO.read_text().splitlines() if line.startswith("flags")).split())
    assert _core.isas() == ["baseline", *(name for name, needed in NEEDS.items() if needed <= flags)]
