"""Program text in messages: format braces, None, and object representations."""

import re
from typing import Any

PRINTED = re.compile(r"[{}]|\bNone\b(?! (of|in|is)\b)|<class|<function|<bound|object at 0x")
MEANT = re.compile(r"ATTR\{\w+\}|\{ \w+ = [^{}]*\}?")
"""A rule of Linux that the program tells, and tables within a line of a protocol file."""
PROPERTIES = ("text", "windowTitle", "toolTip", "accessibleName", "accessibleDescription")


def printed(text: Any) -> bool:
    """Return whether a text holds program text."""
    return isinstance(text, str) and PRINTED.search(MEANT.sub("", text)) is not None


def printed_in_windows() -> list[str]:
    """Return the program text in all windows, shown or hidden, except in text that a user can type."""
    from PySide6.QtWidgets import QApplication, QLineEdit

    texts = [
        (widget, name, text)
        for widget in QApplication.allWidgets()
        for name in PROPERTIES
        if (name != "windowTitle" or widget.isWindow())
        and (text := widget.property(name))
        and isinstance(text, str)
        and not (name == "text" and isinstance(widget, QLineEdit))
    ]
    if PRINTED.search("\n".join(text for _, _, text in texts)) is None:  # one search is quicker than thousands
        return []
    return [f"{type(widget).__name__}.{name}: {text}" for widget, name, text in texts if printed(text)]
