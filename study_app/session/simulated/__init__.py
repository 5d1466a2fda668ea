"""Simulated participants: observers, exploration, rehearsals.

Reading order: observers, paced_levels; participant, predicted_delivery; rehearsal; answers_only, rehearsal_worker.
"""
