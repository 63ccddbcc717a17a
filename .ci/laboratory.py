# SPDX-License-Identifier: MIT
"""Every experiment that has what it needs, in short; exits 1 if one fails: python .ci/laboratory.py"""

import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from experiments import data
from experiments.registry import all_experiments

LIMIT_S = 600
failed, left_out = [], []
for experiment in all_experiments().values():
    if any(not data.has(need, data.root()) for need in experiment.needs):
        left_out.append(experiment.name)
        continue
    begin = time.monotonic()
    command = [sys.executable, "-m", "experiments", "run", "--short", experiment.name]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S)
        said = "" if done.returncode == 0 else (done.stdout + done.stderr)[-1500:]
    except subprocess.TimeoutExpired:
        said = f"not done in {LIMIT_S} s"
    print(f"{experiment.name:28} {time.monotonic() - begin:6.1f} s {said}", flush=True)
    if said:
        failed.append(experiment.name)
print(f"left out, for want of data: {', '.join(left_out) or 'none'}; failed: {', '.join(failed) or 'none'}")
sys.exit(1 if failed else 0)
