# SPDX-License-Identifier: MIT
"""What the kernels move and compute, and how long that takes at the limits of a GPU."""

from __future__ import annotations

from dataclasses import dataclass

from experiments.registry import experiment
from experiments.table import Table

__all__ = ["GPUS", "WORK", "Gpu", "Work", "gpu_estimates", "seconds"]


@dataclass(frozen=True)
class Gpu:
    """Limits from the maker's data sheet: bytes/s of memory, operations/s in single and double precision."""

    name: str
    bytes_per_s: float
    float_per_s: float
    double_per_s: float


GPUS = (
    Gpu("H100", 3.35e12, 67e12, 34e12),
    Gpu("RTX 4060 Laptop", 256e9, 11.6e12, 0.18e12),
)
LAUNCH_S = 3e-6  # a kernel after another in a stream
CHAIN_S = 5e-9  # an operation in double precision that needs the one before, about 8 cycles
WAIT_S = 10e-6  # until the host knows that a stream has come to its end, and the next kernel runs


@dataclass(frozen=True)
class Work:
    """One task: everything that is started for it.

    Attributes
    ----------
    name : str
    goal_ms : float
    memory_bytes, float_ops, double_ops : float
        Moved to or from the device's memory, and computed, by all kernels together.
    launches, waits : int
    chain_ops : float
        Operations one after another, however many run at their side.
    """

    name: str
    goal_ms: float
    memory_bytes: float
    float_ops: float
    double_ops: float
    launches: int
    waits: int
    chain_ops: float = 0


VGA, CELLS, RAYS, READINGS = 640 * 480, 200**3, 115_000, 400 * 400
SEARCHED = 240 * 8 * 250 + 2 * 15 * 11 * 500 + 8 * 4 * 1500
PIXELS, LOOKS = 10_000, 10 + 4  # of one object: pixels, sums over them in a fit and steps of their rays
LAUNCHES = 2 + 2 * 11  # the choice of the pixels, and as many looks as two rounds may ask for
JOINT = 5 * (3_000 + 2 * 20_000)  # pixels of all looks
PIXEL_OPS = 614  # counted on the CPU: instructions for each pack, so operations for each pixel
WORK = (
    # A pixel of a look: 28 bytes in, 8 corners of the volume of which a half is cached, 8 bytes out. Depth is sent
    # once (the rate of PCIe is not counted) and read twice.
    Work("one object, a frame", 0.3, 52 * PIXELS * LOOKS + 12 * VGA, PIXEL_OPS * PIXELS * LOOKS, 0,
         LAUNCHES, 1),
    Work("100 objects, a frame", 10.0, 5200 * PIXELS * LOOKS + 12 * VGA,
         100 * PIXEL_OPS * PIXELS * LOOKS, 0, LAUNCHES, 1),
    # Two objects of 10,000 pixels in four stages (of 500, 3,000, 20,000 and 20,000 pixels, the first on the CPU), each
    # with up to 20 trials of which five are looked at, 1.5 fields a pixel; 400 points that may touch, 500 operations
    # each.
    Work("two objects that touch, a frame", 0.5, 52 * JOINT * 1.5, PIXEL_OPS * JOINT * 1.5, 3 * 5 * 400 * 500,
         3 * 21, 3, 3 * 5 * 12**3 / 3),
    # A look beside those of the pixels: 600 hits of 2 x 60 + 400 operations and 120 lines of 400, in double precision,
    # 25 sums over a block one after another.
    Work("tracker with brightness and outline, a frame", 0.5, 52 * PIXELS * LOOKS, PIXEL_OPS * PIXELS * LOOKS,
         LOOKS * (600 * 520 + 120 * 400), 3 * 11, 3, LOOKS * 25 * 60),
    # A voxel: phi and log ratio in, phi out, its neighbours from the cache; 7 times the potential's slope.
    Work("level set of 200^3, a step", 0.1, 12 * CELLS, 350 * CELLS, 0, 1, 0),
    # 400 x 400 readings of 8 bytes, their roles and image (120 bytes); 3,000 blocks of 8^3 voxels fused (20 bytes in,
    # 16 out), 1,500 relaxed twice (8 bytes); a part of the distances beyond the band; a sweep of these, 64 launches and
    # 5 waits, in every tenth frame.
    Work("reconstruction of 200^3, a frame", 2.0,
         READINGS * 128 + 3000 * 512 * 36 + 2 * 1500 * 512 * 8 + CELLS / 10 * 8,
         READINGS * 60 + 3000 * 512 * 150 + 2 * 1500 * 512 * 60, 3000 * 512 * 20, 45, 2),
    # Four more kernels; each reading's point, distance and evidence there, and its place in a region.
    Work("reconstruction of 200^3, a frame without a mask", 2.0,
         READINGS * 220 + 3000 * 512 * 36 + 2 * 1500 * 512 * 8 + CELLS / 10 * 8,
         READINGS * 200 + 3000 * 512 * 150 + 2 * 1500 * 512 * 60, 3000 * 512 * 20 + READINGS * 60, 49, 2),
    # A pixel: conversion 15 bytes, 5 rounds of 16, 3 rounds of connectivity of 40, labels 12.
    Work("superpixels, 640 x 480", 0.25, (15 + 5 * 16 + 3 * 40 + 12) * VGA, 5 * 9 * 12 * VGA, 0, 20, 1),
    # 1,000 fields of two inputs for each sample; 30 bytes of input and output.
    Work("LWPR, 10^6 predictions", 5.0, 30e6, 0, 1e6 * 1000 * 12, 1, 1),
    # Of 240 rotations 7 steps and a cost over 250 points, of 15 fits twice 11 steps over 500, of 8 four over 1,500. A
    # point as a pixel above, but that its neighbours' corners are cached.
    Work("pose search in a mask", 5.0, 40 * SEARCHED, PIXEL_OPS * SEARCHED, 0, 32, 32),
    # A box of 0.12 m at 0.35 m: 115,000 rays of 10 samples each with its root, counted on the CPU; 120 operations and 8
    # corners a sample, of which a half is cached; 16 bytes out.
    Work("ray casting, 640 x 480", 1.0, RAYS * (16 + 10 * 16), 0, RAYS * 10 * 120, 1, 1),
    # As many rays at a mesh of 15,000 faces: about 40 boxes of 25 operations and 6 triangles of 90, mostly cached.
    Work("ray casting of a mesh, 640 x 480", 1.0, RAYS * (20 + 10 * 56), 0, RAYS * (40 * 25 + 6 * 90), 1, 1),
    # Each voxel read once; a ball with a radius of 80 voxels has 120,000 vertices of 24 bytes, 240,000 faces of 12, in
    # 3,000 blocks that are read twice more, with two bytes a voxel; vertices and faces once again for the copy back.
    Work("mesh of a volume of 200^3", 5.0, 4 * CELLS + 3000 * 512 * 12 + 2 * (120e3 * 24 + 240e3 * 12), 40 * CELLS, 0,
         4, 2),
    # Of the same ball 560,000 triangles of 80 bytes; 640,000 voxels within 4 of it ask 250 cells each, and 40 triangles
    # for their distance (100 operations); 150 rounds of sweeps of 9 bytes a voxel, a wait for 16 rounds.
    Work("distances of a field of 200^3", 10.0, 2 * 560e3 * 80 + 150 * 9 * CELLS, 640e3 * 250 * 20 + 150 * 15 * CELLS,
         640e3 * 40 * 100, 155, 12),
    # 50 outputs of ten inputs, 30 fields each, of which 10 learn side by side, 1,500 operations after one another.
    Work("LWPR, 10^4 updates of 50 outputs", 500.0, 1e4 * 50 * (30 * 250 + 10 * 2000), 0,
         1e4 * 50 * (30 * 30 + 10 * 400), 1, 1, 1e4 * 1500),
)  # fmt: skip


def seconds(work: Work, gpu: Gpu) -> tuple[float, str]:
    """The least time on a GPU, and what limits it."""
    parts = {
        "memory": work.memory_bytes / gpu.bytes_per_s,
        "single precision": work.float_ops / gpu.float_per_s,
        "double precision": work.double_ops / gpu.double_per_s,
        "launches": work.launches * LAUNCH_S + work.waits * WAIT_S,
        "chain": work.chain_ops * CHAIN_S,
    }
    busy = max(parts["memory"], parts["single precision"] + parts["double precision"])
    # Short kernels hide behind the launches, long ones hide these.
    return max(busy, parts["launches"], parts["chain"]), max(parts, key=lambda name: parts[name])


@experiment("gpu_estimates", chosen_on="nothing was chosen", reported_on="nothing was measured", short={})
def gpu_estimates() -> list[Table]:
    """Least times of the kernels on two GPUs, on paper."""
    columns = [
        "work",
        "MB",
        "Gflop",
        "launches",
        "waits",
        "goal ms",
        *(f"{g.name} ms" for g in GPUS),
        "limit",
    ]
    rows = []
    for work in WORK:
        least = [seconds(work, gpu) for gpu in GPUS]
        limits = " / ".join(dict.fromkeys(limit for _, limit in least))
        ops = (work.float_ops + work.double_ops) / 1e9
        rows.append(
            [work.name, f"{work.memory_bytes / 1e6:.1f}", f"{ops:.2f}", f"{work.launches}", f"{work.waits}",
             f"{work.goal_ms:g}", *(f"{1e3 * s:.3f}" for s, _ in least), limits]
        )  # fmt: skip
    return [Table("Least times on paper", columns, rows)]
