"""The study designer without windows: a study's text, its document, and edits that change only the affected bytes."""
