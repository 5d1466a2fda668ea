"""The participant's pages: one widget for each kind of page value."""
