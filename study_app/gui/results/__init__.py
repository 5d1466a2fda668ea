"""Results: which sessions count, their figures, and exports."""
