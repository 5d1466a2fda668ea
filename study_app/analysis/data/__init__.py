"""Results folders read into tables: what was asked, sessions and trials, and measures of them."""
