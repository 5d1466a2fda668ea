"""A study as text and document: rows of its keys, edits that change only the affected bytes, undo. No Qt here."""
