"""Simulated participants: observers, exploration, rehearsals."""
