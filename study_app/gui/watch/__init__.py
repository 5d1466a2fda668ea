"""A recorded trial, watched again: the participant's tank, both forces, and what happened when."""
