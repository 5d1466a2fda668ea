"""Records of the effects."""
