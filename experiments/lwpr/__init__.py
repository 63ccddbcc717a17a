# SPDX-License-Identifier: MIT
"""Regression by local models."""
