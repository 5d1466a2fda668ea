"""The kinds of sinks for markers: one module each, with its descriptor `SINK`."""
