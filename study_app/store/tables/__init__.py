"""Tables of sessions and studies, their columns and descriptions."""
