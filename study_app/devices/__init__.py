"""What can be felt with: every device is two C functions, a workspace and a force limit."""
