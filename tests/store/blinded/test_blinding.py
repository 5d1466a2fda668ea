import base64
import hashlib
import json
import os
import random
import stat
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import stream
from study_app.store.blinded import blinding
from study_app.store.blinded.blinding import check_conditions, open_or_draw_key, reveals, unreadable_reveals
from study_app.store.files.folders import StudyFolder
from tests.protocol.trials.level_studies import study
from tests.store.conftest import Tables


def key_file(folder: Path) -> Path:
    return folder / "blinding" / "key.sealed"


def content_of(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(base64.b64decode(key_file(folder).read_bytes()))
    return content


@pytest.mark.skipif(os.name != "posix", reason="elsewhere files have no such modes")
def test_only_its_owner_may_read_the_key(tmp_path: Path, protocol: Protocol) -> None:
    before = os.umask(0o000)
    try:
        open_or_draw_key(tmp_path, protocol)
    finally:
        os.umask(before)
    assert stat.S_IMODE(key_file(tmp_path).stat().st_mode) == 0o600


def test_the_key_gives_every_code_its_condition(tmp_path: Path, tables_of_study: Tables) -> None:
    tables = tables_of_study()
    tables["conditions"]["learn"] = {"liquids": ["spare", "mildew"]}
    key = open_or_draw_key(tmp_path, Protocol.model_validate(tables))
    assert {key.condition("liquids", code) for code in ("L1", "L2")} == {"feel_quagmire", "feel_mildew"}
    assert {key.condition("delays", code) for code in ("D1", "D2")} == {"see_prompt", "see_tardy"}
    assert key.condition("practice", "practice") == "learn"
    assert key.tables["conditions"]["see_tardy"]["delay_ms"] == 137
    with pytest.raises(StoreError, match="does not contain code 'L9' of block 'liquids'"):
        key.condition("liquids", "L9")


def test_the_file_is_encoded_and_its_sha256_is_the_keys_hash(tmp_path: Path, protocol: Protocol) -> None:
    key = open_or_draw_key(tmp_path, protocol)
    raw = key_file(tmp_path).read_bytes()
    assert key.hash == hashlib.sha256(raw).hexdigest()
    assert not any(word in raw for word in (b"quagmire", b"mildew", b"see_tardy", b"1013.7"))
    assert set(content_of(tmp_path)["tables"]) == {"conditions", "liquids"}
    assert len(bytes.fromhex(content_of(tmp_path)["nonce"])) == 32
    assert "quagmire" not in repr(key)


def test_the_second_of_two_concurrent_programs_reads_the_key_of_the_first(
    tmp_path: Path, protocol: Protocol, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second program has found no key and drawn one, but the first stores its key before it."""
    first: list[blinding.Key] = []
    create = blinding.create_folder

    def after_the_first(path: Path, files: dict[str, bytes], *, mode: int) -> bool:
        monkeypatch.setattr(blinding, "create_folder", create)
        first.append(open_or_draw_key(tmp_path, protocol))
        return create(path, files, mode=mode)

    monkeypatch.setattr(blinding, "create_folder", after_the_first)
    assert open_or_draw_key(tmp_path, protocol) == first[0]


def test_a_real_key_comes_from_the_systems_randomness(
    tmp_path: Path, protocol: Protocol, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seeding the global generator fixes nothing; the draws are ``secrets.SystemRandom``'s."""
    draws: list[float] = []

    class Watched(random.SystemRandom):
        def random(self) -> float:
            draws.append(super().random())
            return draws[-1]

    monkeypatch.setattr(blinding.secrets, "SystemRandom", Watched)
    keys = []
    for folder in (tmp_path / "first", tmp_path / "second"):
        folder.mkdir()
        random.seed(1)
        keys.append(open_or_draw_key(folder, protocol))
    assert keys[0].hash != keys[1].hash
    assert len(draws) == 2 * (32 + 2)  # the nonce, and one draw for each block of two
    assert keys[0].drawn == "system"


def test_a_rehearsals_key_follows_from_its_seed_and_does_not_mix_with_a_real_one(
    tmp_path: Path, protocol: Protocol
) -> None:
    for name in ("one", "two", "three", "real"):
        (tmp_path / name).mkdir()
    open_or_draw_key(tmp_path / "real", protocol)
    first, second, third = (
        open_or_draw_key(tmp_path / name, protocol, stream(seed, "blinding").random)
        for name, seed in (("one", 1), ("two", 1), ("three", 2))
    )
    assert first == second
    assert (first.hash != third.hash, first.drawn) == (True, "seed")
    with pytest.raises(StoreError, match="one contains a rehearsal, which must not be mixed with real sessions"):
        open_or_draw_key(tmp_path / "one", protocol)
    with pytest.raises(StoreError, match="real contains real sessions, which must not be mixed with a rehearsal"):
        open_or_draw_key(tmp_path / "real", protocol, stream(1, "blinding").random)


def test_a_missing_key_is_not_replaced_if_a_session_receipt_exists(tmp_path: Path, protocol: Protocol) -> None:
    session = StudyFolder(tmp_path).session("P001", 1)
    session.path.mkdir(parents=True)
    session.receipt.write_text("{}", encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match=r"key\.sealed is missing, although 1 session used it"):
        open_or_draw_key(tmp_path, protocol)


def test_a_block_with_another_of_the_studys_methods_has_other_conditions(tmp_path: Path) -> None:
    many = '\n[methods.many]\nkind = "constant"\nlevels = [0.1, 0.8]\nrepetitions = 8\n'
    open_or_draw_key(tmp_path, study(more=many))
    check_conditions(tmp_path, study(more=many))
    with pytest.raises(StoreError, match="was sealed for conditions that differ"):
        check_conditions(tmp_path, study(('method = "few"', 'method = "many"'), more=many))


def test_lines_of_unblinding_that_cannot_be_read_are_numbered_from_1(tmp_path: Path) -> None:
    path = StudyFolder(tmp_path).reveals
    path.parent.mkdir(parents=True)
    for last, is_torn in ((b'{"at": "2026-03', True), (b'{"at": "2026-03"}', False)):
        path.write_bytes(b"\nrubbish\n" + last)
        assert unreadable_reveals(tmp_path) == ((2, False), (3, is_torn)), "a power cut leaves half of the last line"
        assert reveals(tmp_path) == ()
    opening = {"at": "2026-03-02T09:30:00+01:00", "by": "AK", "reason": "to analyse", "key_hash": "ab"}
    lines = [opening, *(opening | {name: wrong} for name in opening for wrong in ("", " ", 7))]
    path.write_bytes(b"".join(json.dumps(line).encode() + b"\n" for line in lines))
    assert [line["by"] for line in reveals(tmp_path)] == ["AK"]
    assert unreadable_reveals(tmp_path) == tuple((number, False) for number in range(2, len(lines) + 1))


def test_an_unreadable_key_and_one_of_a_later_format_are_errors(tmp_path: Path, protocol: Protocol) -> None:
    open_or_draw_key(tmp_path, protocol)
    key_content = content_of(tmp_path)
    later, *wrong = (
        base64.encodebytes(json.dumps(key_content | changed).encode())
        for changed in (
            {"format": 3},
            {"drawn": "dice"},
            {"codes": {"liquids": {"A": 1}}},
            {"files": {"honey.toml": 1}},
            {"groups": {"experts": 0}},
            {"groups": {"experts": 1.5}},
            {"tables": key_content["tables"] | {"liquids": []}},
            {"tables": key_content["tables"] | {"conditions": {"late": {"delay_ms": "50"}}}},
        )
    )
    no_key = r"key\.sealed is no longer a sealed key"
    contents = dict.fromkeys((b"", b"not base64 \xff", b"aGVsbG8=\n", b"W10=\n", b"e30=\n", *wrong), no_key)
    for content, sentence in (contents | {later: "has format 3, but this version reads only formats 1 and 2"}).items():
        key_file(tmp_path).write_bytes(content)
        with pytest.raises(StoreError, match=sentence):
            open_or_draw_key(tmp_path, protocol)
