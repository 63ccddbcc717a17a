# SPDX-License-Identifier: MIT
"""Long runs: that neither memory nor the time of a step grows."""
