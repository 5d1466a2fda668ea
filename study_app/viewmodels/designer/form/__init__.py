"""The form of an element: its rows, their facts, and how one form differs from the next. No Qt here."""
