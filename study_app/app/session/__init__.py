"""A session in windows: start-up, bridge, frame budget, endings."""
