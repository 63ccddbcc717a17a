# SPDX-License-Identifier: MIT
"""The picture of docs/trust.md, from `python -m experiments run trust.auc --data DATA --out FOLDER`.

python docs/images/trust.py FOLDER/trust.auc.json docs/images/trust.png
"""

import json
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

samples = json.loads(Path(sys.argv[1]).read_text())["tables"][0]["numbers"]["synthetic"]
rows = [r for r in samples if r[0] in ("tracked", "wrong")]
right, confidence = np.array([r[1] for r in rows]), np.array([r[2] for r in rows])
left, middle = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")[1]
edges = np.linspace(0, 1, 21)
for what, color, name in ((right, "tab:blue", "right"), (~right, "tab:red", "wrong")):
    left.hist(confidence[what], edges, color=color, alpha=0.6, label=f"{name} ({what.sum()})")
left.set(xlabel="confidence", ylabel="poses", yscale="log")
left.legend()
edges = np.linspace(0, 1, 7)
bins = np.clip(np.digitize(confidence, edges) - 1, 0, len(edges) - 2)
for k in range(len(edges) - 1):
    here = bins == k
    n, share = here.sum(), right[here].mean()
    sd = np.sqrt(max(share * (1 - share), 0.25 / n) / n)
    middle.errorbar(confidence[here].mean(), share, 2 * sd, fmt="o", color="tab:blue", capsize=3)
middle.plot([0, 1], [0, 1], ":", color="gray")
middle.set(xlabel="confidence", ylabel="share that is right", xlim=(-0.02, 1.02), ylim=(-0.02, 1.05))
plt.savefig(sys.argv[2], dpi=110)
