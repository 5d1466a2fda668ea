"""The outline: its rows, dragging them, and the list of what can be added."""
