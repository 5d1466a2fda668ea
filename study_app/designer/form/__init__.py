"""The form of one element: its rows, and the fields that edit them."""
