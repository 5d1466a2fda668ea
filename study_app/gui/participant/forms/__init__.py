"""Pages of questions of several kinds: a form, its parts, and what the widgets of questions share."""
