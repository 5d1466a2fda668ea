"""Methods: how the levels of a track are chosen; one module per kind."""
