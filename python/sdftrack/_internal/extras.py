# SPDX-License-Identifier: MIT
"""Packages that only some uses need."""

from __future__ import annotations

import importlib
from typing import Any

__all__ = ["need"]


def need(package: str, extra: str) -> Any:
    """The module, or an ImportError that names the extra of this package which installs it.

    >>> need("no_such_package", "export")
    Traceback (most recent call last):
    ImportError: no-such-package is not installed: pip install 'sdftrack[export]'
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise ImportError(
            f"{package.replace('_', '-')} is not installed: pip install 'sdftrack[{extra}]'"
        ) from error
