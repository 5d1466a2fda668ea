"""The base of the participant's pages, and the pages of text."""
