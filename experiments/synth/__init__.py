# SPDX-License-Identifier: MIT
"""Scenes that only experiments, tests and figures need; those for users are in `sdftrack.synth`."""
