"""The study designer: one open study, its steps, and what its place shows."""
