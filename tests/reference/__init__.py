# SPDX-License-Identifier: MIT
"""The mathematics of the core in plain numpy, slow and obvious: tests compare with it, notebooks explain with it."""
