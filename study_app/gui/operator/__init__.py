"""The operator's window: progress of the session, health of servo and screen, and the operator's actions.

Reading order: servo_health; operator_view; controls, plots, session_panels; window.
"""

from study_app.gui.operator.operator_view import OperatorView, Session, stages, view_session
from study_app.gui.operator.servo_health import Forces, ServoHealth
from study_app.gui.operator.session_panels import Strip
from study_app.gui.operator.window import OperatorWindow

__all__ = ["Forces", "OperatorView", "OperatorWindow", "ServoHealth", "Session", "Strip", "stages", "view_session"]
