"""A run as a scene in three dimensions, for Foxglove and RViz."""

SCENE = "estimates.mcap"  # in a result folder
LAYOUT = "estimates.foxglove.json"  # beside it: what to open it with
