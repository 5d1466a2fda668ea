"""A demo session that is built event by event, as its journal would report it."""

import pytest

from study_app.gui.operator.servo_health import ServoHealth
from tests.gui.operator.session import Told, measured_health, new_session


@pytest.fixture
def demo_session() -> Told:
    return new_session()


@pytest.fixture
def health() -> ServoHealth:
    return measured_health()
