# SPDX-License-Identifier: MIT
"""Every experiment runs with its short options: its tables are whole, its picture can be drawn.

Figures of the thesis do so in a step of .ci/nightly of their own.
"""

from pathlib import Path

import pytest

from experiments.__main__ import run
from experiments.data import has, root
from experiments.registry import PREFIX, Experiment, all_experiments

ON_A_GPU = {"gpu_times"}
KNOWN = {name: e for name, e in all_experiments().items() if not name.startswith(PREFIX)}


@pytest.mark.slow
@pytest.mark.parametrize(
    "known", [pytest.param(e, id=name) for name, e in KNOWN.items() if name not in ON_A_GPU]
)
def test_a_short_run_gives_whole_tables(known: Experiment, tmp_path: Path) -> None:
    data = root()
    missing = [need for need in known.needs if not has(need, data)]
    if missing:
        pytest.skip(f"absent: {', '.join(missing)}")
    if known.name == "superpixel_calls":
        pytest.importorskip("skimage.segmentation.tests", reason="scikit-image without its tests")
    tables = run(known, ["--data", str(data), "--out", str(tmp_path)], short=True)
    # A few frames may leave nothing to a second table, and no view over its limit; notes may be all there is.
    assert any(table.rows or table.notes for table in tables) or known.name == "primitives.limits"
    for table in tables:
        assert all(len(row) == len(table.columns) for row in table.rows)
        assert all(isinstance(cell, str) for row in table.rows for cell in row)
    assert (tmp_path / f"{known.name}.json").is_file()
    drawn = [path for path in tmp_path.iterdir() if path.suffix == ".png"]
    assert len(drawn) == sum(table.picture is not None for table in tables)
