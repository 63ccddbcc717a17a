# SPDX-License-Identifier: MIT
"""Unknown objects reconstructed while they are tracked."""
