# SPDX-License-Identifier: MIT
"""Optional packages."""

from __future__ import annotations

import importlib
from typing import Any


class MissingExtra(ImportError):
    """An optional package is not installed."""


def need(package: str, extra: str) -> Any:
    """Import the module, or raise an ImportError naming the extra of this package that installs it.

    >>> need("no_such_package", "export")
    Traceback (most recent call last):
    ImportError: no-such-package is not installed: pip install 'sdftrack[export]'
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        if not isinstance(error, ModuleNotFoundError):  # it is there, but a library that it links is not
            raise ImportError(f"{package} is installed, but cannot be loaded: {error}") from error
        raise MissingExtra(
            f"{package.replace('_', '-')} is not installed: pip install 'sdftrack[{extra}]'"
        ) from error
