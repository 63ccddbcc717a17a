# SPDX-License-Identifier: MIT
"""Which runs there are, read without the package that they need, and where their recorded data are."""

import ast
import os
from pathlib import Path

RUN_FILES = ("tracking_runs", "start_runs", "shape_runs", "picture_runs")
HERE = Path(__file__).resolve().parent


def data_folder() -> Path:
    """The recorded data: SDFTRACK_DATA, else ../shared/data beside the repository."""
    return Path(os.environ.get("SDFTRACK_DATA") or HERE.parents[2] / "shared" / "data")


def listed() -> dict[str, str]:
    """The file of each run that is possible here."""
    lists = ("SYNTHETIC", "RECORDED") if data_folder().is_dir() else ("SYNTHETIC",)
    return {
        name.id: file
        for file in RUN_FILES
        for statement in ast.parse((HERE / f"{file}.py").read_text()).body
        if isinstance(statement, ast.Assign) and getattr(statement.targets[0], "id", "") in lists
        for name in getattr(statement.value, "elts", ())
    }
