# SPDX-License-Identifier: MIT
"""Tracking of two recorded sequences against their reference poses, by depth (default) or with `--set mode=rgbd`.

python -m sdftrack.eval.real ycbv10 --data DIR     # random starts 10 mm / 5 deg off the truth
python -m sdftrack.eval.real k1 --data DIR         # each of two sponges by itself, still and in the hand
python -m sdftrack.eval.real ycbv10 --data DIR --from-mask    # the same without a pose: from the first frame's mask
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence as Seq
from pathlib import Path

from experiments.tracking.still_and_in_hand import HIDING_M, K1_HAND_LIMITS, K1_LEAST_IOU, K1_TO_FRAME, SIDES, k1_text, run_k1
from experiments.common.pose_sets import half_turns, off_pose
from sdftrack.evaluation.pose_errors import parse_settings
from experiments.tracking.random_starts import YCB_NAMES, cup_axis, run_ycbv10, ycbv10_text

__all__ = [
    "HIDING_M",
    "K1_HAND_LIMITS",
    "K1_LEAST_IOU",
    "K1_TO_FRAME",
    "SIDES",
    "YCB_NAMES",
    "cup_axis",
    "half_turns",
    "main",
    "off_pose",
    "run_k1",
    "run_ycbv10",
]


def _parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser(
        prog="python -m sdftrack.eval.real", description=(__doc__ or "").split("\n")[0]
    )
    p.add_argument("case", choices=["ycbv10", "k1"])
    p.add_argument("--data", type=Path, required=True, help="folder of the sequence (or its parent)")
    p.add_argument("--only", default="", help="ycbv10: box,mug,brick; k1: left,right")
    p.add_argument("--starts", type=int, default=50)
    p.add_argument(
        "--frames", type=int, default=0, help="ycbv10: frames after which a start is judged (5); k1: 141"
    )
    p.add_argument(
        "--from-mask", action="store_true", help="start from the first frame's mask, not from a pose"
    )
    p.add_argument("--voxels", type=int, default=200)
    p.add_argument("--threads", type=int, default=0)
    p.add_argument(
        "--set", action="append", default=[], metavar="OPTION=VALUE", help="an option of the tracker"
    )
    p.add_argument("--json", type=Path)
    return p


def main(arguments: Seq[str] | None = None) -> int:
    """Run the protocol and print the table."""
    a = _parser().parse_args(arguments)
    data = a.data / a.case if (a.data / a.case).is_dir() else a.data
    options = {"threads": a.threads, **parse_settings(a.set)}
    names = [n for n in a.only.split(",") if n]

    def say(text: str) -> None:
        print(f"# {text}", file=sys.stderr, flush=True)

    if a.case == "ycbv10":
        ids = [i for i, n in YCB_NAMES.items() if not names or n in names]
        rows = run_ycbv10(data, a.starts, a.frames or 5, ids, a.voxels, options, say, a.from_mask)
        print(ycbv10_text(rows))
    else:
        sides = [k for k, n in enumerate(SIDES) if not names or n in names]
        keep = a.json is not None
        rows = run_k1(data, a.frames or 141, sides, a.voxels, options, say, keep, a.from_mask)
        print(k1_text(rows))
    if a.json is not None:
        a.json.write_text(json.dumps({"settings": vars(a), "rows": rows}, default=str, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
