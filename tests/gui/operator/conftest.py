"""A demo session told event by event, as the journal would tell it."""

import pytest

from study_app.gui.operator.servo_health import ServoHealth
from tests.gui.operator.session import Told, measured_health, new_session


@pytest.fixture
def told() -> Told:
    return new_session()


@pytest.fixture
def health() -> ServoHealth:
    return measured_health()
