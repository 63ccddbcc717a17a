# SPDX-License-Identifier: MIT
"""Several objects at once."""
