"""Groups of participants and sessions that differ: whose steps a session has, and who gets into which group."""
