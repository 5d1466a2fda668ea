"""The force model as a session resolved it: sealed in its receipt, used where a program would choose otherwise."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import pytest

from study_app.errors import StoreError
from study_app.haptics.model import gate
from study_app.haptics.model.estimators import Ewma, Kalman
from study_app.haptics.model.gate import resolve
from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.blinded.blinding import recorded_protocol, sealed_model
from study_app.store.sessions.open_session import SessionStore
from tests.protocol.trials import level_studies
from tests.store.conftest import Start, Tables
from tests.store.sessions.conftest import Again

MUD = {"density_kg_m3": 1313.7, "viscosity_pa_s": 2.0, "effects": "auto"}


@pytest.fixture
def protocol(tables_of_study: Tables) -> Protocol:
    tables = tables_of_study(format=2, scene={"velocity": {"kind": "kalman"}})
    tables["liquids"]["quagmire"] = MUD
    return Protocol.model_validate(tables)


@pytest.fixture
def running_session(start: Start) -> Iterator[SessionStore]:
    """A running session; a test may close it before its end."""
    with start() as store:
        yield store


def receipt_of(store: SessionStore) -> dict[str, Any]:
    return receipt.read(store.folder.receipt)


def leave_all_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the gate choose as another version might: everything may be left out."""
    monkeypatch.setattr(gate, "_budget_n", lambda _scene, total_n: 2 * total_n)


def test_resume_uses_effects_laws_and_estimator_of_the_receipt(
    running_session: SessionStore, protocol: Protocol, again: Again, monkeypatch: pytest.MonkeyPatch
) -> None:
    (liquid,) = resolve(protocol.scene_of("quagmire")).liquids
    assert protocol.liquids["quagmire"].effects == "auto"
    assert len(liquid.effects) > 1
    running_session.close()
    leave_all_out(monkeypatch)
    now = protocol.model_copy(update={"scene": protocol.scene.model_copy(update={"velocity": Ewma()})})
    assert resolve(now.scene_of("quagmire")).liquids[0].effects != liquid.effects
    with again(protocol=protocol) as store:
        used = store.as_recorded(now)
    assert used.scene.velocity == Kalman()
    assert used.liquids["quagmire"].effects == liquid.effects
    assert used.liquids["quagmire"].drag == liquid.drag
    assert resolve(used.scene_of("quagmire")).liquids[0] == liquid
    assert used.liquids["mildew"] == protocol.liquids["mildew"]


def test_effects_cannot_be_read_in_the_receipt(running_session: SessionStore) -> None:
    running_session.close()
    session_receipt = receipt_of(running_session)
    assert session_receipt["protocol"]["scene"]["velocity"] == {"kind": "kalman"}
    text = running_session.folder.receipt.read_text("utf-8")
    assert "quagmire" not in text
    assert "unsteady_drag" not in text
    assert len(session_receipt["resolved"]) % 64 == 32  # a tag, and blocks


def test_receipts_of_earlier_versions_contain_only_the_estimator(
    running_session: SessionStore, protocol: Protocol
) -> None:
    session_receipt = receipt_of(running_session)
    del session_receipt["resolved"]
    session_receipt["protocol"]["scene"]["velocity"] = {"kind": "ewma", "alpha": 0.2}
    used = recorded_protocol(protocol, session_receipt, running_session.key)
    assert used.scene.velocity == Ewma(alpha=0.2)
    assert used.liquids == protocol.liquids


def test_a_changed_text_or_one_of_another_session_is_refused(running_session: SessionStore, protocol: Protocol) -> None:
    start_receipt, key = receipt_of(running_session), running_session.key
    text = start_receipt["resolved"]
    for other, used in (
        (("0" if text[0] != "0" else "1") + text[1:], key),
        (sealed_model(protocol, "P008", 1, key), key),
        (text, dataclasses.replace(key, nonce=bytes(32))),
    ):
        with pytest.raises(StoreError, match="“resolved” in the receipt of P007 cannot be decrypted"):
            recorded_protocol(protocol, start_receipt | {"resolved": other}, used)


def test_a_liquid_whose_delay_is_varied_keeps_its_effects(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    late = [
        ('effects = ["drag"]\ndrag = { law = "haider-levenspiel" }\n', 'effects = "auto"\n'),
        ('vary = "viscosity_pa_s"\nstandards = [1, 2]\nlevels = [0.1, 0.8]', 'vary = "delay_ms"\nlevels = [50, 200]'),
        ("\nlevels = [0.2, 0.4, 0.8]", "\nlevels = [60, 100]"),
    ]
    protocol = level_studies.study(*late)
    (liquid,) = resolve(protocol.scene_of("thin")).liquids
    with start(protocol=protocol) as store:
        leave_all_out(monkeypatch)
        assert store.as_recorded(protocol).liquids["thin"].effects == liquid.effects
