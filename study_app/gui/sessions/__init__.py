"""Sessions as rows of a table, wherever a window lists them."""
