"""The study designer: one open study, its document, and the rooms that edit and show it."""
