# SPDX-License-Identifier: MIT
"""Superpixels: quality and time."""
