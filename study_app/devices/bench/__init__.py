"""Measuring a device: a fixed protocol of forces, the handle's response, and a report."""
