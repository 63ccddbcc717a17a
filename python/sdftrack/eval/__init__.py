# SPDX-License-Identifier: MIT
"""Accuracy protocols: what is run, what it is compared with, and how it is reported.

``python -m sdftrack.eval.synthetic`` and ``python -m sdftrack.eval.real`` print the tables of results.md.
"""
