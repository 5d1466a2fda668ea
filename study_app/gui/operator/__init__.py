"""The operator's window: progress of the session, health of servo and screen, and the operator's actions."""
