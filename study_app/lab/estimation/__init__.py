"""A liquid's drag coefficient and wake, estimated while force is measured."""
