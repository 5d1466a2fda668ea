"""The right pane: one tab for each view of the study, and its facts below."""
