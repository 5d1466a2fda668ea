"""The outline: elements in their order, dragging them, and what can be added."""
