# SPDX-License-Identifier: MIT
"""Make demo.png, the README's picture, from what ``sdftrack demo`` wrote: python docs/images/demo.py sdftrack-demo"""

import json
import sys
from pathlib import Path

import av
import matplotlib
import numpy as np
from PIL import Image

from sdftrack.viz.plots import COLORS, STATUS_SHADE

matplotlib.use("Agg")
import matplotlib.pyplot as plt

SHOWN = (0.2, 0.594, 0.612, 0.95)  # parts of the time; in the middle a hand passes
WIDTH, GAP, PLOT_HEIGHT = 1200, 6, 190
LEFT, RIGHT = 62 / WIDTH, 1 - 8 / WIDTH
VIEW = (110, 50, 590, 410)  # where the duck moves; left, top, right, bottom, px
PALETTE = 256  # colours; all of them would fill the file with the sensor's noise


def frames(video: Path, count: int) -> list[Image.Image]:
    wanted = {round(s * (count - 1)) for s in SHOWN}
    with av.open(str(video)) as container:
        return [f.to_image().crop(VIEW) for i, f in enumerate(container.decode(video=0)) if i in wanted]


def row(pictures: list[Image.Image]) -> Image.Image:
    width = (WIDTH - GAP * (len(pictures) - 1)) // len(pictures)
    small = [p.resize((width, round(width * p.height / p.width)), Image.Resampling.LANCZOS) for p in pictures]
    out = Image.new("RGB", (WIDTH, small[0].height), "white")
    for n, p in enumerate(small):
        out.paste(p, (n * (width + GAP), 0))
    return out


def plot(folder: Path, report: list[dict]) -> Image.Image:
    truth = np.loadtxt(folder / "ground_truth_0.txt")[:, 1:4]
    objects = [f["objects"][0] for f in report]
    poses = np.array([np.array(o["pose"])[:3, 3] for o in objects])
    error = 1e3 * np.linalg.norm(poses - truth, axis=1)
    fig, axis = plt.subplots(figsize=(WIDTH / 100, PLOT_HEIGHT / 100), dpi=100)
    axis.plot(error, color=COLORS[0], linewidth=1.3)
    named = set()
    for i, o in enumerate(objects):
        if (status := o["status"]) in STATUS_SHADE:
            label = None if status in named else f"the tracker says: {status}"
            axis.axvspan(i - 0.5, i + 0.5, color=STATUS_SHADE[status], alpha=0.5, linewidth=0, label=label)
            named.add(status)
    for s in SHOWN:
        axis.axvline(s * (len(error) - 1), color="0.6", linewidth=0.8, linestyle=":")
    axis.set(xlim=(0, len(error) - 1), ylim=(0, 3), xlabel="frame", ylabel="error (mm)")
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(fontsize=8, loc="upper left", frameon=False)
    fig.subplots_adjust(left=LEFT, right=RIGHT, bottom=0.25, top=0.96)
    fig.canvas.draw()
    return Image.fromarray(np.asarray(fig.canvas.buffer_rgba())[..., :3])


def main(folder: Path) -> None:
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))["frames"]
    top, bottom = row(frames(folder / "overlay.mp4", len(report))), plot(folder, report)
    out = Image.new("RGB", (WIDTH, top.height + bottom.height), "white")
    out.paste(top, (0, 0))
    out.paste(bottom, (0, top.height))
    few = out.quantize(PALETTE, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    few.save(Path(__file__).with_name("demo.png"), optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
