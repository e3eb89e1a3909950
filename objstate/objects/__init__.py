"""Where is each object? One sample-based filter per object."""
