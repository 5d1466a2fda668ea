"""Whether hard closed loops of liquid, servo, device and hand stay stable, and how much damping they bear."""
