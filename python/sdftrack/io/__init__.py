# SPDX-License-Identifier: MIT
"""Files in and out; every conversion to metres, seconds and radians happens here."""
