# SPDX-License-Identifier: MIT
import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder with the recorded sequences; tests that need them skip without it."""
    given = os.environ.get("SDFTRACK_DATA")
    folder = Path(given) if given else Path(__file__).resolve().parents[1].parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"recorded data absent: {folder} (set SDFTRACK_DATA to the folder with k1 and ycbv10)")
    return folder
