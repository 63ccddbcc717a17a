# SPDX-License-Identifier: MIT
"""Primitives of unknown size."""
