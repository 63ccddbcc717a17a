# SPDX-License-Identifier: MIT
"""Status, confidence and covariance."""
