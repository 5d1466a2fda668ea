"""Tests with windows are skipped if Qt cannot be loaded."""

try:
    import PySide6.QtWidgets  # noqa: F401
except ImportError:
    collect_ignore = ["test_windows.py", "test_leaks.py", "test_survives.py"]
