# SPDX-License-Identifier: MIT
"""Exercises with known truth, rendered, tracked and measured."""
