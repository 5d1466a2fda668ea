"""Where markers may go: a module for each kind, with its descriptor `SINK`."""
