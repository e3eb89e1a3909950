"""A run as a scene in three dimensions, for Foxglove and RViz."""

SCENE = "estimates.mcap"  # in a result folder
