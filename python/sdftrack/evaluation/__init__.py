# SPDX-License-Identifier: MIT
"""Evaluation against ground truth: pose errors, their lower bound, tables and plots of `sdftrack evaluate`."""
