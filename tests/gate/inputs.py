# SPDX-License-Identifier: MIT
"""What the runs share."""

from __future__ import annotations

import sdftrack as st

Hashes = dict[str, str]
CAMERA = st.Camera(fx=260, fy=260, cx=159.5, cy=119.5, width=320, height=240)
