"""Questionnaires: their questions, scales, conditions and instruments, and the simulated observer who answers them."""
