# SPDX-License-Identifier: MIT
"""The synthetic and labelled scenes of the figures."""
