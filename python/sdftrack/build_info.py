# SPDX-License-Identifier: MIT
"""What this build is and what it runs on."""

from __future__ import annotations

import os
import platform
import sys
from pathlib import Path
from typing import Any

__all__ = ["info"]


def info() -> dict[str, Any]:
    """Version, build options, CPU features in use, GPU and threads, as plain values.

    >>> import sdftrack as st
    >>> st.info()["threads"] >= 1
    True
    """
    import numpy as np

    from sdftrack import _core
    from sdftrack.device import cuda_available

    build = dict(getattr(_core, "build", {}))
    return {
        "version": _core.__version__,
        "python": sys.version.split()[0],
        "numpy": np.__version__,
        "platform": platform.platform(),
        "extension": str(_core.__file__),
        "compiler": build.get("compiler", "unknown"),
        "optimised": build.get("optimised"),
        "cuda_build": bool(_core.cuda_build),
        "cpu": _cpu_name(),
        "cpu_features_in_use": [_core.isa()],
        "cpu_features": list(_core.isas()),
        "gpu": _core.cuda_device_name() if cuda_available() else None,
        "cuda_available": cuda_available(),
        "cores": os.cpu_count() or 1,
        "threads": int(_core.thread_count(0)),
    }


def _cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
