"""Drawing it: windows for operator and participant."""
