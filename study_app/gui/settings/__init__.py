"""The settings of this machine: screens, viewing distance, text size, display offset, device and folders."""
