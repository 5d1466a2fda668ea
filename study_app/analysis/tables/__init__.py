"""Results folders read into tables, and measures of trials."""
