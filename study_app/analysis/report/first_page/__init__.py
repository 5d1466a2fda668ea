"""The report's first page: three answers, each with direction, size and interval."""
