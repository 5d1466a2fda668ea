"""Edits of a study's text: splices that change what an edit concerns and nothing else."""
