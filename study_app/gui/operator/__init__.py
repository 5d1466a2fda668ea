"""The operator's window: where we are, whether it is healthy, and what the operator can do."""

from study_app.gui.operator.window import OperatorWindow

__all__ = ["OperatorWindow"]
