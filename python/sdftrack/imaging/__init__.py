# SPDX-License-Identifier: MIT
"""Analysis of a frame before tracking: regions, planes, colours, and user hints for objects."""
