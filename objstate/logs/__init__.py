"""Recorded logs in, records out: MCAP, rosbag1, rosbag2, CARMEN."""
