# SPDX-License-Identifier: MIT
"""Many recordings: that every one is done once whatever dies, and what a call costs beyond its work."""
