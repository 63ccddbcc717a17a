# SPDX-License-Identifier: MIT
"""Cameras without hardware, for tests and benches."""
