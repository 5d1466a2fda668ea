"""Whether hard closed loops of liquid, servo, device and hand stay stable, and their maximum stable damping."""
