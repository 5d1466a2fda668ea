"""Errors cross processes: each is the same after pickling, with its fields."""

import pickle

import pytest

from study_app import errors
from study_app.designer.document.toml_text import Refused
from study_app.designer.participant.playable import NotPlayableError
from study_app.devices.doctor import DeviceFailure, DeviceFailureNotFound
from study_app.devices.falcon.boot import BootFailure
from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure
from study_app.errors import Problem, ProtocolError, StudyError
from study_app.store.recordings import SealedRecording
from study_app.store.study_versions import ChangedOutsideError
from study_app.workers.server import Stopped

PLAIN = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, StudyError)]
PROTOCOL = ProtocolError(
    "a.toml", (Problem("blocks.b", "is unknown", 3, "did you mean c?"), Problem("x", "is missing"))
)
USB = UsbFailure("busy", "opening it", -6)
EXAMPLES = [
    *(
        kind(f"what, value, hint of {kind.__name__}")
        for kind in [*PLAIN, Stopped, Refused, ChangedOutsideError, NotPlayableError, SealedRecording]
        if kind is not ProtocolError
    ),
    PROTOCOL,
    *(kind("busy", "opening it", -6) for kind in (UsbFailure, FalconNotFound, FalconLost)),
    BootFailure("echo", 2, "nothing came back"),
    *(kind("silent", "it stopped answering") for kind in (DeviceFailure, DeviceFailureNotFound)),
]


def _kinds(base: type[StudyError]) -> set[type[StudyError]]:
    return {base}.union(*(_kinds(kind) for kind in base.__subclasses__()))


def test_every_kind_of_error_has_an_example() -> None:
    of_program = {kind for kind in _kinds(StudyError) if kind.__module__.startswith("study_app.")}
    assert {type(one) for one in EXAMPLES} == of_program


@pytest.mark.parametrize("error", EXAMPLES, ids=lambda error: type(error).__name__)
def test_an_error_is_the_same_after_pickling(error: StudyError) -> None:
    error.add_note("in case 3")
    found = pickle.loads(pickle.dumps(error))  # noqa: S301 - made here
    assert type(found) is type(error)
    assert (str(found), found.args, vars(found)) == (str(error), error.args, vars(error))
    assert found.__notes__ == ["in case 3"]
