import pytest

from study_app.protocol.model import Protocol
from tests.session import small
from tests.session.fakes import World


@pytest.fixture(scope="session")
def protocol() -> Protocol:
    return small.protocol()


@pytest.fixture
def world() -> World:
    return World()
