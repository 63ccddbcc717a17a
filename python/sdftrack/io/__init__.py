# SPDX-License-Identifier: MIT
"""File input and output, including all conversions to metres, seconds and radians."""
