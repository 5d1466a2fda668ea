"""The operator's window: progress of the session, health of servo and screen, and the operator's actions.

Reading order: servo_health; operator_view; controls, plots, session_panels; window.
"""
