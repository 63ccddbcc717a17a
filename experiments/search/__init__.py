# SPDX-License-Identifier: MIT
"""Starts without a pose."""
