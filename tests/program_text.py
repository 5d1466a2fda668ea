"""Program text that was printed instead of words: braces of a format, None, the representation of an object."""

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
    """Return the program text in all windows there are, shown or not; what people type in a field is theirs."""
    from PySide6.QtWidgets import QApplication, QLineEdit

    return [
        f"{type(widget).__name__}.{name}: {text}"
        for widget in QApplication.allWidgets()
        for name in PROPERTIES
        if printed(text := widget.property(name)) and not (name == "text" and isinstance(widget, QLineEdit))
    ]
