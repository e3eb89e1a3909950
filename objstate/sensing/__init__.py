"""What each beam should read, and how likely it is to read what it read."""
