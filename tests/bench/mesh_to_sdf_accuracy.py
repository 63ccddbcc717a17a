# SPDX-License-Identifier: MIT
"""Time and error of SDF.from_mesh against libigl's exact distance: ``python mesh_to_sdf_accuracy.py MESH...``

Meshes in metres; ``--unit mm`` for others. Prints a table; the sizes are fixed, so that it can be compared.
"""

import argparse
import statistics
import time
import warnings

import igl
import numpy as np

import sdftrack as st

VOXELS, POINTS, RUNS = 200, 20_000, 5
SHELLS = [(0.0, 5.5), (5.5, 15.0), (15.0, 40.0)]  # voxels from the surface; the first lies in the exact band


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("meshes", nargs="+")
    parser.add_argument("--unit")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", UserWarning)
    print(f"{VOXELS} voxels; max (mean) error in voxels, wrong signs, of {POINTS} voxels a shell")
    for path in arguments.meshes:
        mesh = st.Mesh.load(path, unit=arguments.unit)
        seconds = []
        for _ in range(RUNS):
            start = time.perf_counter()
            sdf = st.SDF.from_mesh(mesh, voxels=VOXELS)
            seconds.append(time.perf_counter() - start)
        print(f"{path}: median {statistics.median(seconds):.2f} s; " + "; ".join(shell_errors(sdf, mesh)))


def shell_errors(sdf: st.SDF, mesh: st.Mesh) -> list[str]:
    rng, lines = np.random.default_rng(0), []
    for low, high in SHELLS:
        distance = np.abs(sdf.values) / sdf.voxel_size
        cells = np.argwhere((distance >= low) & (distance < high))
        if len(cells) == 0:
            continue
        cells = cells[rng.choice(len(cells), min(POINTS, len(cells)), replace=False)]
        points = sdf.origin + sdf.voxel_size * cells[:, ::-1]
        kind = igl.SignedDistanceType.SIGNED_DISTANCE_TYPE_WINDING_NUMBER
        truth = igl.signed_distance(points, mesh.vertices, mesh.faces.astype(np.int64), kind)[0]
        found = sdf.values[tuple(cells.T)]
        error = np.abs(found - truth) / sdf.voxel_size
        wrong = np.count_nonzero((found < 0) != (truth < 0))
        lines.append(f"{low:g}-{high:g}: {error.max():.4f} ({error.mean():.4f}), {wrong}")
    return lines


if __name__ == "__main__":
    main()
