import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from study_app.protocol.load import parse
from study_app.protocol.streams import stream
from study_app.store.blinded.blinding import complete_protocol, open_or_draw_key, read_key
from study_app.store.folders import StudyFolder
from study_app.store.receipt import without_conditions
from tests.protocol.trials.level_studies import text_of


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
    assert complete_protocol(shown, read_key(tmp_path)) == protocol


def test_sessions_are_listed_while_a_participant_is_withdrawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study, listed = StudyFolder(tmp_path), Path.glob
    study.session("P002", 1).path.mkdir(parents=True)
    gone = iter([True, False])

    def folder_that_goes(self: Path, pattern: str) -> Iterator[Path]:
        if next(gone):
            raise FileNotFoundError(self / "sub-P001")
        return listed(self, pattern)

    monkeypatch.setattr(Path, "glob", folder_that_goes)
    assert study.ids() == ("P002",)
