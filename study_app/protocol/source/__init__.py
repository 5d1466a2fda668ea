"""The protocol file: where it is, its lines and its problems."""
