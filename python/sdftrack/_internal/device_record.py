# SPDX-License-Identifier: MIT
"""Which GPUs have passed their self-test, remembered for this user, device and build."""

from __future__ import annotations

import json
import os
from pathlib import Path

from sdftrack import _core
from sdftrack._internal.files import write_json

__all__ = ["has_passed", "record_path", "remember"]


def record_path() -> Path:
    """The user's file, in ``$XDG_CACHE_HOME`` or ``~/.cache``."""
    folder = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(folder) / "sdftrack" / "cuda_self_test.json"


def has_passed(number: int) -> bool:
    """Whether this build has passed the self-test on the device, with its present driver."""
    return _known().get(_key(number)) is True


def remember(number: int, passed: bool) -> None:
    """Write down the result of a self-test; where the user's folder cannot be written, it is known nowhere."""
    try:
        path = record_path()
        path.parent.mkdir(parents=True, exist_ok=True)
        write_json(path, {**_known(), _key(number): bool(passed)})
    except (OSError, RuntimeError):  # RuntimeError: the user has no home
        pass


def _known() -> dict[str, bool]:
    try:
        found = json.loads(record_path().read_text(encoding="utf-8"))
    except (OSError, ValueError, RuntimeError):
        return {}
    return found if isinstance(found, dict) else {}


def _key(number: int) -> str:
    built = Path(str(_core.__file__)).stat()
    return (
        f"sdftrack {_core.__version__}, {built.st_size}-{built.st_mtime_ns}: {_core.cuda_fingerprint(number)}"
    )
