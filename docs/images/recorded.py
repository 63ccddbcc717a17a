# SPDX-License-Identifier: MIT
"""Make recorded.jpg, the README's picture, from the recordings ycbv10 and mustard0: python docs/images/recorded.py DATA

The image is of YCB-Video (Xiang et al., PoseCNN, 2017; MIT, (c) 2017 University of Washington), the errors are those in
YCBInEOAT's mustard0 (Wen et al., IROS 2020).
"""

import sys
from pathlib import Path

import matplotlib
import numpy as np

import sdftrack as st

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
SIZE_IN, DPI = (12, 4.0), 100


def three_objects(scene: Path) -> np.ndarray:
    """The last frame of a short recording, with what was tracked in it from the masks of the first."""
    with st.open_sequence(scene) as seq:
        shapes = [st.SDF.from_mesh(seq.models[number]) for number in seq.objects]
        tracker = st.Tracker(shapes, seq.camera)
        result = tracker.start(seq[0], masks=[seq.masks(0)[k] for k in range(len(shapes))])
        for frame in seq[1:]:
            result = tracker.track(frame)
        return st.draw(frame, result, shapes, seq.camera)


def bottle(scene: Path) -> tuple[np.ndarray, list[str]]:
    """Of each frame the ADD-S in mm and the status, from the mask of the first frame on."""
    with st.open_sequence(scene) as seq:
        mesh = seq.models[seq.objects[0]]
        tracker = st.Tracker(st.SDF.from_mesh(mesh), seq.camera)
        errors, status = [], []
        for frame in seq:
            result = tracker.track(frame) if status else tracker.start(frame, masks=[seq.masks(0)[0]])
            truth = seq.ground_truth[frame.index][0]
            errors.append(1e3 * st.metrics.adds(result.pose, truth, mesh.vertices))
            status.append(str(result.status[0]))
    return np.array(errors), status


def main(data: Path) -> None:
    errors, status = bottle(data / "mustard0")
    picture = three_objects(data / "ycbv10")
    width = SIZE_IN[1] / SIZE_IN[0] * picture.shape[1] / picture.shape[0]
    fig = plt.figure(figsize=SIZE_IN, dpi=DPI)
    left, right = fig.add_axes((0, 0, width, 1)), fig.add_axes((width + 0.06, 0.14, 0.93 - width, 0.76))
    left.imshow(picture, aspect="auto")
    left.axis("off")
    right.plot(errors, linewidth=1.3)
    right.set(xlim=(0, len(errors) - 1), ylim=(0, None), xlabel="frame", ylabel="ADD-S (mm)")
    good = status.count("ok")
    right.set_title(f"a bottle that a robot turns: {good} of {len(status)} frames ok, none lost", fontsize=10)
    right.spines[["top", "right"]].set_visible(False)
    fig.savefig(HERE / "recorded.jpg", pil_kwargs={"quality": 88})


if __name__ == "__main__":
    main(Path(sys.argv[1]))
