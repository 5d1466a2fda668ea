"""Findings about factors that are not presented: the session in which, and the site at which, answers were given."""
