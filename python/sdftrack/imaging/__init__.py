# SPDX-License-Identifier: MIT
"""Analysis of a frame before tracking: regions, planes, and user hints for objects."""
