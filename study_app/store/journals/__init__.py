"""The journal: lines, events, writing, reading, damage."""
