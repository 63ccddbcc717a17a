# SPDX-License-Identifier: MIT
"""The GPU path: what its kernels should take, and what they take."""
