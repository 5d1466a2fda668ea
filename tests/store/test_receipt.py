import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from study_app import __version__
from study_app.errors import StoreError
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.streams import stream
from study_app.store.blinded.blinding import open_or_draw_key, read_key
from study_app.store.blinded.whole_protocol import whole_protocol
from study_app.store.receipt import read, versions, without_conditions, write
from tests.protocol.trials.level_studies import text_of


def test_the_protocol_is_kept_without_its_conditions(protocol: Protocol) -> None:
    shown = without_conditions(protocol)
    whole = protocol.model_dump(mode="json")
    assert set(whole) - set(shown) == {"liquids", "conditions"}
    assert shown["questionnaires"] == whole["questionnaires"]
    assert shown["scales"] == whole["scales"]
    assert shown["pages"] == whole["pages"]
    assert shown["tasks"] == whole["tasks"]
    assert shown["limits"] == whole["limits"]
    assert shown["blocks"]["liquids"]["codes"] == ["L1", "L2"]
    assert shown["blocks"]["practice"]["codes"] == ["practice"]
    assert {name: block["compares"] for name, block in shown["blocks"].items() if block["phase"] == "main"} == {
        "liquids": "liquids",
        "delays": "delays",
    }
    assert shown["blocks"]["practice"]["compares"] is None
    assert not any("conditions" in block for block in shown["blocks"].values())


@pytest.mark.parametrize(
    "steps",
    [
        ('sequence = ["viscosity"]', 'sequence = ["viscosity"]'),
        ('sequences = [["viscosity"], ["viscosity"]]', 'sequence = ["viscosity"]'),
        ("", 'sequences = [["viscosity"]]'),
        (),
    ],
)
def test_the_protocol_is_whole_again_with_its_key_whoever_has_which_steps(tmp_path: Path, steps: Sequence[str]) -> None:
    groups = "".join(f"\n[groups.g{number}]\n{own}\n" for number, own in enumerate(steps))
    shared = () if "" in steps else (('sequence = ["viscosity"]\n', "" if steps else 'sequences = [["viscosity"]]\n'),)
    protocol = parse(f"{text_of(*shared)}{groups}".encode(), "levels")
    open_or_draw_key(tmp_path, protocol, random=stream(1, "key").random)
    shown = json.loads(json.dumps(without_conditions(protocol)))
    assert whole_protocol(shown, read_key(tmp_path)) == protocol


def test_versions_name_what_shapes_a_session() -> None:
    found = versions()
    assert found["liquid-study"] == __version__
    assert {"python", "system", "numpy", "numba", "pydantic", "PySide6-Essentials"} < set(found)
    assert all(found.values())


def test_a_receipt_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "receipt.json"
    write(path, {"key_hash": "ab", "device": {"name": "naïve 🌊", "rate_hz": float("nan")}})
    assert read(path) == {"key_hash": "ab", "device": {"name": "naïve 🌊", "rate_hz": None}}
    assert path.read_bytes().endswith(b"}\n")


@pytest.mark.parametrize("content", [b"", b"{", b"[]", json.dumps({"format": 1}).encode(), b"\xff"])
def test_what_is_no_receipt_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "receipt.json"
    path.write_bytes(content)
    with pytest.raises(StoreError, match=r"receipt\.json is not a receipt"):
        read(path)


def test_a_missing_receipt_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"receipt\.json cannot be read"):
        read(tmp_path / "receipt.json")
