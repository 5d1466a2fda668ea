"""The results page: the sessions that are included, their figures, and exports."""
