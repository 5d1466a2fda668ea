"""Orders made again from a receipt."""

import json
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.verification.reproduction import reproduced
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo]


def test_a_rehearsed_session_is_reproduced_and_with_another_seed_it_is_not(tmp_path: Path) -> None:
    session = rehearse("demo", participants=1, seed=3, results=tmp_path / "demo") / "data/sub-P001/ses-01"
    assert reproduced(session).differences == []
    receipt = session / "receipt.json"
    told = json.loads(receipt.read_text())
    differ = set()
    for seed in range(8):
        receipt.write_text(json.dumps(told | {"seed": seed}))
        differ.add(bool(reproduced(session).differences))
    assert True in differ
    del told["seed"]
    receipt.write_text(json.dumps(told))
    with pytest.raises(StoreError, match="seed"):
        reproduced(session)
