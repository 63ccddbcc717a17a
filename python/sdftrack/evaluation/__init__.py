# SPDX-License-Identifier: MIT
"""Evaluation against ground truth: scores, tables and plots of `sdftrack evaluate`."""
