"""A liquid's drag coefficient and wake from a stream of measured force, estimated while it comes."""
