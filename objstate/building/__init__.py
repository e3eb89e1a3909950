"""Buildings: URDF models, occupancy maps, and what is wrong with them."""
