# SPDX-License-Identifier: MIT
"""Experiments: what the documents claim, measured. `python -m experiments list` names them."""
