"""Habits of doors and furniture: how often they are moved, and where to, by time and kind of day."""
