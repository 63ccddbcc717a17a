# SPDX-License-Identifier: MIT
"""Internal helpers; nothing here is public."""
