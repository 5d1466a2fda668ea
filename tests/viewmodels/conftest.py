"""What the operator's view is made of, shared with the tests of its window."""

from tests.gui.operator.conftest import health, told

__all__ = ["health", "told"]
