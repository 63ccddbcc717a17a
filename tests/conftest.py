# SPDX-License-Identifier: MIT
"""Two tiers of tests, and where recorded data are."""

from pathlib import Path

import pytest

import tiers
from experiments.data import root


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder with the recorded sequences; tests that need them skip without it."""
    folder = root()
    if not folder.is_dir():
        pytest.skip(f"recorded data absent: {folder} (set SDFTRACK_DATA to the folder with k1 and ycbv10)")
    return folder


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--all", action="store_true", help="also the tests that tests/nightly.txt leaves to the night"
    )


def _runs_all(config: pytest.Config) -> bool:
    return config.getoption("--all") or "nightly" in config.getoption("markexpr")


def _named(config: pytest.Config) -> set[Path]:
    """The files on the command line, of which everything runs."""
    given = (config.invocation_params.dir / argument.partition("::")[0] for argument in config.args)
    return {path.resolve() for path in given if path.is_file()}


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Files that are left to the night are not even imported."""
    if not tiers.is_left_whole(collection_path) or _runs_all(config) or collection_path in _named(config):
        return None
    return True


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    named, runs_all = _named(config), _runs_all(config)
    kept, left = [], []
    for item in items:
        nightly = tiers.is_nightly(item.path, item.nodeid.partition("::")[2])
        if nightly:
            item.add_marker("nightly")
        (left if nightly and not runs_all and item.path not in named else kept).append(item)
    if left:
        items[:] = kept
        config.hook.pytest_deselected(items=left)
