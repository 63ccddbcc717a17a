# SPDX-License-Identifier: MIT
"""Results against the truth: errors of poses, their least possible size, tables and plots of `sdftrack evaluate`."""
