# SPDX-License-Identifier: MIT
"""Times and memory of calls and of whole processes."""
