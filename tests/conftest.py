# SPDX-License-Identifier: MIT
from pathlib import Path

import pytest

from experiments.data import root


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder with the recorded sequences; tests that need them skip without it."""
    folder = root()
    if not folder.is_dir():
        pytest.skip(f"recorded data absent: {folder} (set SDFTRACK_DATA to the folder with k1 and ycbv10)")
    return folder
