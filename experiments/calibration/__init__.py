# SPDX-License-Identifier: MIT
"""Intrinsics, colour to depth."""
