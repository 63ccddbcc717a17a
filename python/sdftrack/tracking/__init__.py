# SPDX-License-Identifier: MIT
"""Track known shapes in depth and colour images, from a pose, a mask, a box or nothing but the shape."""

import sys as _sys

from sdftrack.tracking import pickling as _pickling
from sdftrack.tracking.tracker import Tracker

__all__ = ["Tracker"]

# The names that files of earlier versions have for how a tracker is made again.
_rebuild = _pickling.rebuild
_sys.modules[f"{__name__}.saving"] = _pickling
