# SPDX-License-Identifier: MIT
"""Where the data of the experiments are, and whether what an experiment needs is there."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterable
from pathlib import Path

PACKAGE = "package:"  # prefix of a need that is a Python package, not a folder
BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"


class MissingError(FileNotFoundError):
    """Data or a package that an experiment needs are not there."""


def root(given: Path | None = None) -> Path:
    """The data folder: `given`, else SDFTRACK_DATA, else ../shared/data beside the repository."""
    if given is not None:
        return given
    return Path(os.environ["SDFTRACK_DATA"]) if os.environ.get("SDFTRACK_DATA") else BESIDE


def has(need: str, data: Path) -> bool:
    """Whether a folder of `data` (or the package of ``"package:NAME"``) is there."""
    if need.startswith(PACKAGE):
        return importlib.util.find_spec(need.removeprefix(PACKAGE)) is not None
    return (data / need).is_dir()


def check(name: str, needs: Iterable[str], data: Path) -> None:
    """MissingError that names everything that is missing, and what to do."""
    missing = [need for need in needs if not has(need, data)]
    if not missing:
        return
    folders = [need for need in missing if not need.startswith(PACKAGE)]
    packages = [need.removeprefix(PACKAGE) for need in missing if need.startswith(PACKAGE)]
    fixes = []
    if folders:
        fixes.append(
            f"expected the folders {', '.join(folders)} in {data}; "
            "set SDFTRACK_DATA or pass --data with the folder that holds them"
        )
    if packages:
        fixes.append(f"expected the packages {', '.join(packages)}; pip install {' '.join(packages)}")
    raise MissingError(f"{name}: {'; '.join(fixes)}")
