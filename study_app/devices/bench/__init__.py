"""Measuring a device: a fixed protocol of forces, what the handle did under them, and a report."""
