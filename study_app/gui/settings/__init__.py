"""What this machine is like, set by its operator: screens, distance, text, display offset, device, folders."""
