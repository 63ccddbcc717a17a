# SPDX-License-Identifier: MIT
"""What a record was measured with, as digests: whether it would still be measured today.

An experiment names its own module, and by its folder the runs of the gate (tests/gate/hashes.json) whose results its
figures rest on. Their digests are stored with each run of a record. A change of the code that keeps all results keeps
them; one that changes a result, decided and written to hashes.json, makes the records that rest on it stale.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
from pathlib import Path
from typing import Any

from experiments import record
from experiments.registry import Experiment, all_experiments

ROOT = Path(__file__).resolve().parents[1]
TRACKING = ("depth", "rgbd", "lens")
GATE = {  # by folder of this package
    "batch": TRACKING,
    "calibration": ("cameras",),
    "contour": ("contours", "memory", "regression"),
    "exercise": TRACKING,
    "gpu": (),
    "lwpr": ("regression",),
    "planes": ("volumes", "recorded_tables"),
    "primitives": ("primitives", "recorded_tables"),
    "reconstruction": ("reconstruction",),
    "robustness": (*TRACKING, "lost", "start"),
    "search": ("start", "click", "anywhere"),
    "several": ("several", "overlapping", "look_alikes"),
    "speed": (),
    "superpixels": ("superpixels", "recorded_images"),
    "tracking": (*TRACKING, "photometric", "recorded_bop"),
    "trust": (*TRACKING, "lost", "free_size"),
}


def digests(experiment: Experiment) -> dict[str, str]:
    """Digest of the experiment's module, without comments and layout, and of each run of the gate, by name."""
    module = experiment.function.__module__
    spec = importlib.util.find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    file = Path(spec.origin)
    out = {file.relative_to(ROOT).as_posix(): of_code(file.read_text(encoding="utf-8"))}
    recorded = json.loads((ROOT / "tests/gate/hashes.json").read_text(encoding="utf-8"))["hashes"]
    for run in GATE.get(module.removeprefix("experiments.").split(".")[0], ()):
        out[f"gate: {run}"] = _digest(json.dumps(recorded[run], sort_keys=True))
    return out


def stale() -> dict[str, list[str]]:
    """Records of experiments that no longer rest on today's code, with what has changed since, by name."""
    known, out = all_experiments(), {}
    for name in record.names():
        if name in known and (changed := changed_since(record.load(name), digests(known[name]))):
            out[name] = changed
    return out


def changed_since(one: dict[str, Any], now: dict[str, str]) -> list[str]:
    """What differs from `now` in any run of a record; a run without digests was measured before there were any."""
    changed = set()
    for run in one["runs"]:
        if run.get("retired"):
            continue
        then = run.get("sources")
        if then is None:
            changed.add(f"measured at {run['commit']}, without digests")
        else:
            changed |= {name for name in {*then, *now} if then.get(name) != now.get(name)}
    return sorted(changed)


def of_code(text: str) -> str:
    """Digest of a Python file without its comments, docstrings and layout."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if (
            isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
            and ast.get_docstring(node) is not None
        ):
            node.body = node.body[1:]
    return _digest(ast.dump(tree))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]
