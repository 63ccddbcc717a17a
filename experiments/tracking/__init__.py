# SPDX-License-Identifier: MIT
"""One object, tracked by depth or RGB-D."""
