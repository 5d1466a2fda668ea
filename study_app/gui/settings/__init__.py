"""Settings of this machine: screens, distance, text, display offset, device, folders."""
