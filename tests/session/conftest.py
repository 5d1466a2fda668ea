from __future__ import annotations

import pytest

from study_app.protocol.model import Protocol
from tests.session import small


@pytest.fixture(scope="session")
def protocol() -> Protocol:
    return small.protocol()
