"""Session folders from the first claim to the end."""
