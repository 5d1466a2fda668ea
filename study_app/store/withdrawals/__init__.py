"""Withdrawal of participants: what they gave is erased, and a tombstone per participant remains."""
