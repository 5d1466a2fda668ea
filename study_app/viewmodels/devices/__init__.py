"""What windows show of haptic devices, as values without Qt."""
