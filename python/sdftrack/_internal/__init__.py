# SPDX-License-Identifier: MIT
"""What the package uses inside; nothing here is public."""
