# SPDX-License-Identifier: MIT
"""What the figures measure: runs of trackers and reconstructors, and the judgement of their results."""
