"""The participant's pages: what they share, and pages of text."""
