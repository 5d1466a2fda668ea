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
from study_app.store.blinded.blinding import (
    check_conditions,
    open_or_draw_key,
    reveal,
    revealed_key,
    reveals,
    unreadable_reveals,
)
from study_app.store.blinded.unblinding import unblind
from study_app.store.verification.verify_study import verify
from tests.protocol.trials.level_studies import study
from tests.store.conftest import Start, Tables


def sealed(folder: Path) -> Path:
    return folder / "blinding" / "key.sealed"


def content_of(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(base64.b64decode(sealed(folder).read_bytes()))
    return content


@pytest.mark.skipif(os.name != "posix", reason="elsewhere files have no such modes")
def test_only_its_owner_may_read_the_key(tmp_path: Path, protocol: Protocol) -> None:
    before = os.umask(0o000)
    try:
        open_or_draw_key(tmp_path, protocol)
    finally:
        os.umask(before)
    assert stat.S_IMODE(sealed(tmp_path).stat().st_mode) == 0o600


def test_the_key_gives_every_code_its_condition(tmp_path: Path, tables_of_study: Tables) -> None:
    tables = tables_of_study()
    tables["conditions"]["learn"] = {"liquids": ["spare", "mildew"]}
    key = open_or_draw_key(tmp_path, Protocol.model_validate(tables))
    assert {key.condition("liquids", code) for code in ("L1", "L2")} == {"feel_quagmire", "feel_mildew"}
    assert {key.condition("delays", code) for code in ("D1", "D2")} == {"see_prompt", "see_tardy"}
    assert key.condition("practice", "practice") == "learn"
    assert key.liquids("practice", "practice") == ("spare", "mildew")
    tardy = next(code for code in ("D1", "D2") if key.condition("delays", code) == "see_tardy")
    assert (key.delay_ms("delays", tardy), key.liquids("delays", tardy)) == (137, ("quagmire",))
    with pytest.raises(StoreError, match="has no code 'L9' of block 'liquids'"):
        key.condition("liquids", "L9")


def test_the_file_is_encoded_and_its_sha256_is_the_keys_hash(tmp_path: Path, protocol: Protocol) -> None:
    key = open_or_draw_key(tmp_path, protocol)
    raw = sealed(tmp_path).read_bytes()
    assert key.hash == hashlib.sha256(raw).hexdigest()
    assert not any(word in raw for word in (b"quagmire", b"mildew", b"see_tardy", b"1013.7"))
    assert set(content_of(tmp_path)["tables"]) == {"conditions", "liquids"}
    assert len(bytes.fromhex(content_of(tmp_path)["nonce"])) == 32
    assert "quagmire" not in repr(key)


def test_who_comes_second_reads_what_the_first_drew(
    tmp_path: Path, protocol: Protocol, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second has found no key and drawn its own; before it can put it down, the first has."""
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
    drawn: list[float] = []

    class Watched(random.SystemRandom):
        def random(self) -> float:
            drawn.append(super().random())
            return drawn[-1]

    monkeypatch.setattr(blinding.secrets, "SystemRandom", Watched)
    keys = []
    for folder in (tmp_path / "first", tmp_path / "second"):
        folder.mkdir()
        random.seed(1)
        keys.append(open_or_draw_key(folder, protocol))
    assert keys[0].hash != keys[1].hash
    assert len(drawn) == 2 * (32 + 2)  # the nonce, and one draw for each block of two
    assert keys[0].drawn == "system"


def test_a_rehearsals_key_follows_from_its_seed_and_does_not_mix_with_a_real_one(
    tmp_path: Path, protocol: Protocol
) -> None:
    for name in ("one", "two", "three", "real"):
        (tmp_path / name).mkdir()
    open_or_draw_key(tmp_path / "real", protocol)
    one, two, three = (
        open_or_draw_key(tmp_path / name, protocol, stream(seed, "blinding").random)
        for name, seed in (("one", 1), ("two", 1), ("three", 2))
    )
    assert one == two
    assert (one.hash != three.hash, one.drawn) == (True, "seed")
    with pytest.raises(StoreError, match="one holds a rehearsal: they must not be mixed with real sessions"):
        open_or_draw_key(tmp_path / "one", protocol)
    with pytest.raises(StoreError, match="real holds real sessions: they must not be mixed with a rehearsal"):
        open_or_draw_key(tmp_path / "real", protocol, stream(1, "blinding").random)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("liquids.mildew.density_kg_m3", 1200),
        ("conditions.see_tardy.delay_ms", 139),
        ("blocks.liquids.conditions", ["feel_mildew", "feel_quagmire"]),
        ("blocks.liquids.code_prefix", "Q"),
    ],
)
def test_a_protocol_with_other_conditions_is_refused_without_naming_them(
    tmp_path: Path, protocol: Protocol, tables_of_study: Tables, place: str, value: Any
) -> None:
    key = open_or_draw_key(tmp_path, protocol)
    tables = tables_of_study()
    tables["pages"]["consent"]["body"] = "Other words."
    assert open_or_draw_key(tmp_path, Protocol.model_validate(tables)) == key
    of, name, last = place.split(".")
    tables[of][name][last] = value
    with pytest.raises(StoreError, match="was sealed for other conditions than those of this protocol") as refusal:
        open_or_draw_key(tmp_path, Protocol.model_validate(tables))
    with pytest.raises(StoreError, match="undo that change") as early:
        check_conditions(tmp_path, Protocol.model_validate(tables))
    assert str(early.value) == str(refusal.value)
    message = str(refusal.value).replace(str(tmp_path), "")  # whose name holds any number
    assert not any(word in message for word in ("mildew", "tardy", "139", "1200"))


def test_a_block_with_another_of_the_studys_methods_has_other_conditions(tmp_path: Path) -> None:
    many = '\n[methods.many]\nkind = "constant"\nlevels = [0.1, 0.8]\nrepetitions = 8\n'
    open_or_draw_key(tmp_path, study(more=many))
    check_conditions(tmp_path, study(more=many))
    with pytest.raises(StoreError, match="was sealed for other conditions"):
        check_conditions(tmp_path, study(('method = "few"', 'method = "many"'), more=many))


def test_an_unreadable_key_and_one_of_a_later_format_are_errors(tmp_path: Path, protocol: Protocol) -> None:
    open_or_draw_key(tmp_path, protocol)
    later = base64.encodebytes(json.dumps(content_of(tmp_path) | {"format": 3}).encode())
    no_key = r"key\.sealed is no longer a sealed key"
    contents = dict.fromkeys((b"", b"not base64 \xff", b"aGVsbG8=\n", b"W10=\n", b"e30=\n"), no_key)
    for content, sentence in (contents | {later: "has format 3, this version reads 1 and 2"}).items():
        sealed(tmp_path).write_bytes(content)
        with pytest.raises(StoreError, match=sentence):
            open_or_draw_key(tmp_path, protocol)


def test_a_tampered_key_is_found_by_receipts_and_journals_and_a_lost_one_is_not_drawn_anew(
    start: Start, tmp_path: Path
) -> None:
    with start("P001") as store:
        store.finish("completed")
    folder = tmp_path / "study"
    content = content_of(folder)
    codes = content["codes"]["liquids"]
    codes["L1"], codes["L2"] = codes["L2"], codes["L1"]
    sealed(folder).write_bytes(base64.encodebytes(json.dumps(content).encode()))
    for _ in range(2):
        for attempt in (lambda: start("P002"), lambda: reveal(folder, "AB", "analysis")):
            with pytest.raises(StoreError, match=r"is not the key that .*sub-P001.* ran under"):
                attempt()
        store.folder.receipt.write_bytes(b"?")  # then the journal tells
    sealed(folder).unlink()
    with pytest.raises(StoreError, match=r"key\.sealed is missing, though 1 sessions ran under it"):
        start("P002")
    assert not sealed(folder).exists()
    assert not (folder / "data" / "sub-P002").exists()
    assert reveals(folder) == ()


def test_a_damaged_receipt_stops_no_session_but_its_own(start: Start, tmp_path: Path) -> None:
    contents = (b"", b"{}", b'{"key_hash', b"\xff\xfe", None)
    for number, content in enumerate(contents, start=1):
        with start(f"P{number:03d}") as store:
            pass
        if content is None:
            store.folder.receipt.unlink()
        else:
            store.folder.receipt.write_bytes(content)
    start("P009").finish("completed")
    assert set(unblind(tmp_path / "study", by="AK", reason="done").codes) == {"practice", "liquids", "delays"}
    assert [error.place for error in verify(tmp_path / "study").errors] == [
        f"data/sub-P{number:03d}/ses-01/receipt.json" for number in range(1, 6)
    ]


def test_a_reveal_is_recorded_before_it_tells(start: Start, tmp_path: Path) -> None:
    store = start("P001")
    store.finish("completed")
    folder = tmp_path / "study"
    assert revealed_key(folder) is None
    codes = reveal(folder, " Dr. Ørsted ", 'end of data, "n = 1"\n')
    assert codes == store.key.codes
    assert revealed_key(folder) == store.key
    reveal(folder, "CD", "again")
    first, second = reveals(folder)
    assert (first["by"], first["reason"], first["key_hash"]) == ("Dr. Ørsted", 'end of data, "n = 1"', store.key.hash)
    assert first["at"] <= second["at"]
    assert (folder / "blinding" / "reveals.jsonl").read_bytes().count(b"\n") == 2


def test_a_reveal_needs_a_name_a_reason_and_its_record(start: Start, tmp_path: Path) -> None:
    start("P001").finish("completed")
    folder = tmp_path / "study"
    path = folder / "blinding" / "reveals.jsonl"
    for by, reason, named in (("", "done", "--by"), ("AB", " \n", "--reason")):
        with pytest.raises(StoreError, match=f"{named} is empty"):
            reveal(folder, by, reason)
    assert not path.exists()
    path.mkdir()
    with pytest.raises(StoreError, match=r"reveals\.jsonl cannot be"):
        reveal(folder, "AB", "analysis")
    with pytest.raises(StoreError, match=r"is not a study folder \(it has no key\.sealed\): name one"):
        reveal(tmp_path, "AB", "analysis")


def test_a_line_that_is_no_reveal_is_told_and_the_others_count(start: Start, tmp_path: Path) -> None:
    start("P001").finish("completed")
    folder, wrong = tmp_path / "study", (b"5", b"null", b'"by AB"', b"[1]", b"xat: 2026")
    (folder / "blinding" / "reveals.jsonl").write_bytes(b"\n".join(wrong) + b"\n")
    assert revealed_key(folder) is None
    unblind(folder, "AB", "done")
    assert unreadable_reveals(folder) == tuple((number, False) for number in range(1, 6))
    assert [one["by"] for one in reveals(folder)] == ["AB"]
    assert [str(one) for one in verify(folder).errors] == [
        f"blinding/reveals.jsonl: line {number} is not a reveal: it was changed; restore it from a copy"
        for number in range(1, 6)
    ]
