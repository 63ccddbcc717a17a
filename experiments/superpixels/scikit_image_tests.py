# SPDX-License-Identifier: MIT
"""scikit-image's own tests of its `slic`, run on ours with only the import changed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from importlib.metadata import version
from pathlib import Path
from xml.etree import ElementTree

from experiments.registry import experiment
from experiments.table import Table

THEIRS = re.compile(r"^from skimage\.segmentation import slic$", re.MULTILINE)
OURS = "from sdftrack.superpixels import slic"
FETCH = "unpack what pip download --no-deps --no-binary scikit-image scikit-image gives"


def their_tests(folder: Path | None) -> Path:
    """Their tests: in `folder`, or where an installed scikit-image has them (it did up to 0.25)."""
    import skimage

    inside = folder if folder is not None else Path(skimage.__file__).parent / "segmentation/tests"
    path = inside / "test_slic.py"
    if not path.is_file():
        raise ValueError(f"--tests: expected a folder with test_slic.py, got {inside}; {FETCH}")
    return path


def with_our_import(text: str) -> str:
    """Only the line that imports the function is another."""
    changed, times = THEIRS.subn(OURS, text)
    if times != 1:
        raise ValueError(f"test_slic.py: expected one line that imports slic, got {times}")
    return changed


def results_of(text: str) -> dict[str, bool]:
    """Whether each test of a file passes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "test_slic.py").write_text(text)
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--junitxml=out.xml", "."]
        alone = {k: v for k, v in os.environ.items() if k != "PYTEST_ADDOPTS"}  # of whoever runs this
        ran = subprocess.run(command, cwd=folder, env=alone, capture_output=True, text=True, check=False)
        if ran.returncode not in (0, 1):
            raise ValueError(f"test_slic.py: expected tests that run, got\n{ran.stdout[-500:]}")
        cases = ElementTree.parse(folder / "out.xml").iter("testcase")
        return {c.get("name", ""): c.find("failure") is None and c.find("error") is None for c in cases}


@experiment(
    "superpixel_calls",
    chosen_on="the same tests",
    reported_on="the tests of slic in scikit-image's source distribution",
)
def superpixel_calls(*, tests: Path | None = None) -> Table:
    """scikit-image's own tests of slic on ours: how many pass with only the import changed.

    Parameters
    ----------
    tests
        folder of test_slic.py, of scikit-image's source distribution
    """
    results = results_of(with_our_import(their_tests(tests).read_text()))
    count = Counter(results.values())
    failed = [name for name, passed in results.items() if not passed]
    return Table(
        "scikit-image's tests of slic with our function",
        ("scikit-image", "tests", "pass", "fail"),
        [(version("scikit-image"), str(len(results)), str(count[True]), str(count[False]))],
        [f"fails: {', '.join(failed) or 'none'}"],
        {"failed": failed},
    )
