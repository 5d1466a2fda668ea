"""Orders made again from a receipt."""

import json

import pytest

from study_app.errors import StoreError
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.verification.reproduction import reproduced
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return rehearse("demo", participants=1, seed=3, results=tmp_path_factory.mktemp("r") / "demo") / (
        "data/sub-P001/ses-01"
    )


def test_a_rehearsed_session_is_reproduced(session) -> None:
    assert reproduced(session).differences == []


def test_another_seed_in_the_receipt_is_seen(session) -> None:
    receipt = session / "receipt.json"
    kept = receipt.read_bytes()
    told = json.loads(kept)
    try:
        seen = set()
        for seed in range(8):
            receipt.write_text(json.dumps(told | {"seed": seed}))
            seen.add(bool(reproduced(session).differences))
        assert True in seen
    finally:
        receipt.write_bytes(kept)


def test_a_receipt_that_lacks_something_is_named(session) -> None:
    receipt = session / "receipt.json"
    kept = receipt.read_bytes()
    told = json.loads(kept)
    del told["seed"]
    try:
        receipt.write_text(json.dumps(told))
        with pytest.raises(StoreError, match="seed"):
            reproduced(session)
    finally:
        receipt.write_bytes(kept)
