# SPDX-License-Identifier: MIT
import os
from pathlib import Path

import pytest


def pytest_configure(config: pytest.Config) -> None:
    # An installed package brings its fixtures by its entry point; a source tree does not.
    if not config.pluginmanager.hasplugin("sdftrack"):
        from sdftrack.testing import fixtures

        config.pluginmanager.register(fixtures, "sdftrack")


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder with the recorded sequences; tests that need them skip without it."""
    given = os.environ.get("SDFTRACK_DATA")
    folder = Path(given) if given else Path(__file__).resolve().parents[2].parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"recorded data absent: {folder} (set SDFTRACK_DATA to the folder with k1 and ycbv10)")
    return folder
