"""What can be felt with on this machine, and what is wrong with it."""
