# SPDX-License-Identifier: MIT
"""Threads that never hurt: forked processes, the end of the interpreter, and the same bits on any number of them."""

import _thread
import functools
import multiprocessing
import os
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest
from tracking_scene import CAMERA, POSE, SIZE_M, depth_of

import sdftrack as st
from experiments.synth.region_picture import region_picture

BOX = st.SDF.box(SIZE_M, voxels=64)
IMAGE = region_picture(240, 320)[0]
needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")


def work() -> bytes:
    """Bytes of results that come of loops over many chunks."""
    result = st.Tracker(BOX, CAMERA).start(st.Frame(depth_of()), masks=depth_of() < 1)
    return result.poses.tobytes() + st.superpixels.slic(IMAGE, 200).tobytes()


expected = functools.cache(work)


def answer(_: int) -> bool:
    return work() == expected()


@needs_fork
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_process_works_like_its_parent_while_a_thread_of_that_is_at_work():
    stop = threading.Event()

    def busy():
        while not stop.is_set():
            st.superpixels.slic(IMAGE, 200)

    expected()
    thread = threading.Thread(target=busy)
    thread.start()
    try:
        for _ in range(5):
            child = os.fork()
            if child == 0:
                os._exit(0 if answer(0) else 1)
            assert os.waitpid(child, 0)[1] == 0
        with multiprocessing.get_context("fork").Pool(2) as pool:
            assert pool.map(answer, range(4)) == [True] * 4
    finally:
        stop.set()
        thread.join()


@pytest.mark.slow
@pytest.mark.parametrize("daemon", [False, True])
def test_the_interpreter_ends_while_threads_are_inside_the_core(daemon):
    script = f"""
        import threading, time
        import numpy as np, sdftrack as st
        image = np.random.default_rng(0).integers(0, 256, (240, 320, 3), np.uint8)
        def work():
            for _ in range(1000000 if {daemon} else 20):
                st.superpixels.slic(image, 200)
        for _ in range(3):
            threading.Thread(target=work, daemon={daemon}).start()
        time.sleep(0.3)
    """
    for _ in range(5):
        done = subprocess.run(
            [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=60
        )
        assert (done.returncode, done.stderr) == (0, "")


STORM = 64
PLACES = np.random.default_rng(0).uniform(-1, 1, (1000, 2))
SHARED = st.LWPR(init_D=50, threads=1).update(PLACES, np.sin(3 * PLACES[:, 0]))


def test_a_storm_of_threads_gives_the_bits_of_one():
    """Each follows an object with a tracker of its own, cuts a picture and asks a model that all share, all at once."""
    begin, found = threading.Barrier(STORM), [b""] * STORM

    def follow(n: int) -> bytes:
        own = st.SDF.box(SIZE_M, voxels=32)
        tracker = st.Tracker(own, CAMERA, threads=1 + n % 4)
        poses = [tracker.start(st.Frame(depth_of()), poses=[POSE]).poses]
        poses += [tracker.track(st.Frame(depth_of(seed=k))).poses for k in range(3)]
        labels = st.superpixels.slic(IMAGE, 200, threads=1 + n % 3)
        return np.stack(poses).tobytes() + labels.tobytes() + SHARED.predict(PLACES).tobytes()

    def run(n: int) -> None:
        begin.wait()
        found[n] = follow(n)

    alone = follow(0)
    threads = [threading.Thread(target=run, args=(n,)) for n in range(STORM)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads)
    assert [n for n in range(STORM) if found[n] != alone] == []


@needs_fork
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_processes_of_every_kind_work_after_the_parent_has_used_all_its_threads(method):
    assert answer(0)
    with multiprocessing.get_context(method).Pool(2) as pool:
        assert pool.map_async(answer, range(4)).get(60) == [True] * 4


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system has no affinity")
def test_a_process_bound_to_one_processor_says_so():
    one = min(os.sched_getaffinity(0))
    script = (
        f"import os; os.sched_setaffinity(0, [{one}]); import sdftrack as st; print(st.info()['threads'])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "1"


# -- Ctrl-C in the middle of a call
ENDS_WITHIN_S = 2.5  # of calls of many seconds; the look is every 50 ms, and the machine may be busy


def learn(model, x):
    model.update(x, np.sin(x.sum(axis=1)))


@functools.cache
def calls():
    """Calls that take many seconds on one thread."""
    rng = np.random.default_rng(3)
    x = rng.random((400_000, 4))
    asked = st.LWPR(4, 1, init_D=50.0, threads=1)
    learn(asked, x[:2_000])
    large = st.SDF.box(SIZE_M, voxels=300)
    huge = st.Camera(9000, 9000, 1919.5, 1079.5, 3840, 2160)
    mesh = large.to_mesh()
    return {
        "LWPR.update": lambda: learn(st.LWPR(4, 1, init_D=50.0, threads=1), x),
        "LWPR.predict": lambda: asked.predict(np.tile(x, (20, 1)), confidence=True),
        "SDF.redistanced": lambda: large.redistanced(threads=1),
        "SDF.render": lambda: large.render(huge, POSE),
        "Mesh.raycast": lambda: mesh.raycast(huge, POSE),
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["LWPR.update", "LWPR.predict", "SDF.redistanced", "SDF.render", "Mesh.raycast"]
)
def test_ctrl_c_ends_a_long_call_at_once(name):
    call = calls()[name]
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    begin = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        call()
    assert time.perf_counter() - begin < ENDS_WITHIN_S


@pytest.mark.slow
def test_a_model_that_was_broken_off_has_learnt_from_the_samples_so_far():
    x = np.random.default_rng(3).random((400_000, 4))
    model, again = (st.LWPR(4, 1, init_D=50.0, threads=1) for _ in range(2))
    learn(model, x[:10])
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        learn(model, x)
    learnt = model.n_samples - 10
    assert 0 < learnt < len(x)
    learn(again, np.concatenate([x[:10], x[:learnt]]))
    np.testing.assert_array_equal(model.predict(x[:50]), again.predict(x[:50]))
