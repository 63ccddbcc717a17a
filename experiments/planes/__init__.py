# SPDX-License-Identifier: MIT
"""Planes in scenes, corners of three planes."""
