# SPDX-License-Identifier: MIT
"""Bags: ROS 1, ROS 2 (SQLite and MCAP), and MCAP files of Foxglove; also those that a RealSense recorded. A file is one
`Part` (`rosbag1`, `sqlite_file`, `mcap_file`): an index of its messages, and their bytes by place. A `Bag` joins the
files of a recording; `decoding` and `pictures` turn messages into arrays; `topics` chooses what belongs together;
`opening` makes frames of it, which are read on access."""
