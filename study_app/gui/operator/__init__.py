"""The operator's window: progress of the session, health of servo and screen, and the operator's actions.

The window is imported when it is first used, since other places need its texts without plots.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from study_app.gui.operator.window import OperatorWindow

__all__ = ["OperatorWindow"]


def __getattr__(name: str) -> Any:
    """Return the window's class."""
    if name != "OperatorWindow":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from study_app.gui.operator.window import OperatorWindow  # noqa: PLC0415 - pyqtgraph: only once it is needed

    return OperatorWindow
