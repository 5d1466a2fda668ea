"""A session in its windows: start-up, pre-flight, the connection with the windows, and playback."""
