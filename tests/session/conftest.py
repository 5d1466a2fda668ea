import pytest

from study_app.protocol.model import Protocol
from study_app.session.transitions.events import Begin, Continue
from tests.session import small
from tests.session.fakes import World


@pytest.fixture(scope="session")
def protocol() -> Protocol:
    return small.protocol()


@pytest.fixture
def world() -> World:
    return World()


@pytest.fixture
def practising(world: World) -> World:
    """Return a world in the practice: an exploration of 1 to 3 s without a questionnaire."""
    world.runner.post(Begin(0.0))
    world.runner.post(Continue(0.0))
    world.log.clear()
    return world
