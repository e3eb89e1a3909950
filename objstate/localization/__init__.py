"""Where is the robot? Monte Carlo localization."""
