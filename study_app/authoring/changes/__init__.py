"""Changes of several elements at once: moves, copies as text, languages."""
