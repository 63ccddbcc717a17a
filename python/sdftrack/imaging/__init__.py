# SPDX-License-Identifier: MIT
"""What a frame shows before anything is tracked: regions, planes, colours, and where a user says an object is."""
