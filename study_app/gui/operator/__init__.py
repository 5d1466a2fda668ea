"""The operator's window: where we are, whether it is healthy, and what the operator can do.

The window is loaded when it is asked for: what it says of a session is needed where nothing is plotted.
"""

from __future__ import annotations

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
