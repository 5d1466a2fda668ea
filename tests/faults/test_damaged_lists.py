"""Damaged small files besides the sessions (fixed seeds): a reader reports the damage or reads valid values."""

import contextlib
import json
import os
import random
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from study_app import workspace
from study_app.analysis.planning import preregistration
from study_app.devices.falcon import calibration
from study_app.errors import StudyError
from study_app.store import workstation
from study_app.store.blinded.allocation import claims
from study_app.store.exclusions import Exclusion, reversals
from study_app.store.files.folders import StudyFolder
from study_app.store.files.output_files import outputs
from study_app.store.integrity.checksums import read_list, unreadable_lines
from study_app.store.merged import Merged, Site, all_exclusions, read_merged
from study_app.store.versions import drafts
from study_app.store.withdrawals import ErasedSession, Tombstone, tombstones
from study_app.user_folder import data_folder, settings_file
from tests.damage import with_a_bit_flipped, with_an_odd_value, with_deep_nesting
from tests.platforms import needs_posix

SEED = int(os.environ.get("LIQUID_STUDY_DAMAGE_SEED", "5"))
CASES = 4 * int(os.environ.get("LIQUID_STUDY_DAMAGE_CASES", "5"))
AT = "2026-03-02T09:30:00.000+01:00"
HASH = "0123456789abcdef" * 4
LINE = json.dumps(
    {
        "at": AT,
        "by": "AB",
        "reason": "x",
        "exclusion": asdict(
            Exclusion(participant="P1", session=1, trial=None, rule_or_person="CD", reason="y", excluded_at=AT)
        ),
    }
)
TOMBSTONE = Tombstone(
    participant="P1",
    at=AT,
    by="AB",
    reason="asked",
    sessions=(ErasedSession(session=1, begun=HASH, checksums=HASH, fingerprint="k3vq-7m2p-xw4d"),),
)
MERGED = Merged(
    Path(),
    "demo",
    HASH,
    (Site(name="A", merged_at=AT, key_hash=HASH, sessions=3), Site(name="B", merged_at=AT, key_hash=HASH, sessions=4)),
)
COMMITMENT = preregistration.Commitment(
    study="demo", version="1", protocol_hash=HASH, participants=24, precision=0.1, rules=("catch",)
)


def read_workspace(_folder: Path) -> object:
    current = workspace.workspace()
    return current.own_protocols(), current.results.is_dir()


def use_commitment(folder: Path) -> object:
    commitment = preregistration.read_commitment(folder)
    return commitment and (commitment.protocol_hash[:12], set(commitment.rules))


KINDS: dict[str, tuple[Callable[[Path], Path], str, Callable[[Path], object]]] = {
    "reversed exclusions": (lambda f: f / "exclusions_reversed.jsonl", f"{LINE}\n{LINE}\n", reversals),
    "withdrawals": (
        lambda f: f / "withdrawals.jsonl",
        f"{json.dumps(asdict(TOMBSTONE))}\n",
        lambda f: tombstones(StudyFolder(f)),
    ),
    "sites": (lambda f: f / "sites.json", MERGED.content().decode(), lambda f: (read_merged(f), all_exclusions(f))),
    "entry": (
        lambda f: StudyFolder(f).allocation(1),
        json.dumps({"entry": 1, "participant": "P1", "sealed": "00ff"}),
        lambda f: claims(StudyFolder(f)),
    ),
    "fingerprints": (
        lambda f: f / "fingerprints.txt",
        "k3vq-7m2p-xw4d  data/sub-P007/ses-01\n",
        lambda f: (read_list(f / "fingerprints.txt"), unreadable_lines(f / "fingerprints.txt")),
    ),
    "preregistration": (
        lambda f: f / preregistration.FILE,
        preregistration.commitment_lines(COMMITMENT),
        use_commitment,
    ),
    "settings": (
        lambda _: settings_file(),
        workstation.DEFAULTS.model_dump_json(),
        lambda _: workstation.load_settings(),
    ),
    "workspace": (lambda _: settings_file(), '{"workspace": "/tmp", "results": "/tmp/results"}', read_workspace),
    "outputs": (
        lambda _: data_folder() / "outputs.jsonl",
        '{"study": "STUDY", "to": "/tmp", "at": "now", "files": ["a.csv"]}\n',
        lambda f: [output.paths for output in outputs(f)],
    ),
    "draft": (
        lambda f: data_folder() / "drafts" / f"{drafts.file_key(f / 'x.toml')}.json",
        '{"file": "FILE", "base": "", "selected": ["study", 1], "kept_at": "now", "text": "x"}',
        lambda f: (drafts.draft_of(f / "x.toml"), drafts.drafted_files()),
    ),
    "calibration": (
        lambda _: calibration.calibration_file("1"),
        json.dumps(asdict(calibration.Calibration(geometry="libnifalcon", units_per_nm=6616.0))),
        lambda _: calibration.load_calibration("1"),
    ),
}


def damaged(content: bytes, chance: random.Random) -> Iterator[bytes]:
    yield from (b"", bytes(len(content)), content[: len(content) // 2])
    for _ in range(CASES):
        yield with_a_bit_flipped(content, chance)
    for damage in (with_an_odd_value, with_deep_nesting) if content.startswith(b"{") else ():
        for _ in range(CASES):
            yield damage(content, chance)
    for depth in (900, 3000, 100_000) if b"```json" in content else ():
        yield content.replace(b"24", b"[" * depth + b"]" * depth)


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_is_an_error_for_people_and_never_a_traceback(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("LIQUID_STUDY_WORKSPACE", raising=False)
    monkeypatch.chdir(tmp_path)
    place, text, read = KINDS[kind]
    path = place(tmp_path)
    path.parent.mkdir(parents=True, exist_ok=True)
    names = {"STUDY": tmp_path, "FILE": tmp_path / "x.toml"}
    content = re.sub("STUDY|FILE", lambda match: json.dumps(str(names[match[0]]))[1:-1], text).encode()
    path.write_bytes(content)
    assert read(tmp_path), kind
    errors: list[Any] = []
    for change in damaged(content, random.Random(f"{SEED} {kind}")):  # noqa: S311 - a fixed choice of damage
        path.write_bytes(change)
        with contextlib.suppress(StudyError):
            try:
                read(tmp_path)
            except StudyError as error:
                errors.append(error)
                raise
    assert all(len(str(error)) < 1000 and "\n" not in str(error) for error in errors), max(map(str, errors), key=len)


@pytest.mark.parametrize("field", ["participant", "at", "by", "reason", "session", "begun", "checksums", "fingerprint"])
def test_a_withdrawal_with_a_value_of_another_type_is_refused(tmp_path: Path, field: str) -> None:
    held = asdict(TOMBSTONE)
    of_field = held if field in held else held["sessions"][0]
    of_field[field] = "1" if field == "session" else 1
    (tmp_path / "withdrawals.jsonl").write_text(f"{json.dumps(held)}\n", encoding="utf-8", newline="\n")
    with pytest.raises(StudyError, match="line 1 is not a withdrawal"):
        tombstones(StudyFolder(tmp_path))


@pytest.mark.parametrize("folder", ["a\0b", pytest.param("\ud83c", marks=needs_posix)])  # Windows has such folders
def test_a_workspace_that_no_folder_can_be_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str
) -> None:
    monkeypatch.delenv("LIQUID_STUDY_WORKSPACE", raising=False)
    monkeypatch.chdir(tmp_path)
    settings_file().parent.mkdir(parents=True, exist_ok=True)
    settings_file().write_text(json.dumps({"workspace": folder}), encoding="utf-8", newline="\n")
    assert folder not in str(workspace.workspace().results)
