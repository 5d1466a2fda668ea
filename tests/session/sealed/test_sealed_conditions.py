"""No number that the program writes tells a liquid or a delay while the key is sealed; after unblinding they do."""

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.source.files import source_bytes
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded import blinding
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.unblinding import unblind
from tests.compiled import needs_servo
from tests.journal_lines import raw
from tests.session.sealed.numbers_written import Trials, every_number, told

pytestmark = [pytest.mark.slow, needs_servo]

SESSIONS = 24
QUICK = (("min_s", "2"), ("count", "2"), ("dwell_s", "0.05"))
MORE = """
[liquids.light_oil]
density_kg_m3 = 4500
effects = ["drag", "wake"]
[liquids.light_oil.wake]
length = 125
scaling = 250
exponent = 0.25
[conditions.light_oil]
liquid = "light_oil"
"""


def numbers_of(folder: Path, block: str) -> Trials:
    """Return the numbers in a study folder about each trial of a block, with its condition."""
    codes = blinding.read_key(folder).codes[block]

    def condition(line: dict[str, Any]) -> str | None:
        return codes[line["code"]] if line["block"] == block else None

    numbers: Trials = {}
    for session in StudyFolder(folder).sessions():
        numbers |= every_number(session, "demo", raw(journal.read(session.journal)), condition)
    return numbers


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("told")
    text = source_bytes("demo").decode()
    changes = [(rf"^{key} = [\d.]+", f"{key} = {value}") for key, value in QUICK]
    changes.append((r'"thin", "thick"\]', '"thin", "thick", "light_oil"]'))
    for pattern, change in changes:
        text, changed = re.subn(pattern, change, text, flags=re.MULTILINE)
        assert changed == 1, pattern
    protocol = folder / "short.toml"
    protocol.write_text(text + MORE, encoding="utf-8", newline="\n")
    return rehearse(protocol, participants=SESSIONS, seed=5, results=folder / "results")


@pytest.mark.parametrize("block", ["liquids", "delays"])
def test_written_numbers_do_not_predict_conditions_better_than_chance(rehearsed: Path, block: str) -> None:
    right, trials, p = told(numbers_of(rehearsed, block))
    assert p > 0.01, f"{right} of {trials} trials were told (p = {p:.2g})"


@pytest.mark.parametrize("block", ["liquids", "delays"])
def test_written_numbers_predict_conditions_after_unblinding(rehearsed: Path, tmp_path: Path, block: str) -> None:
    """This proves that the search can succeed and that the sealed values exist."""
    folder = tmp_path / "opened"
    shutil.copytree(rehearsed, folder)
    assert unblind(folder, "AB", "to see that it tells").left == ()
    right, trials, p = told(numbers_of(folder, block))
    assert p < 0.005, f"{right} of {trials} trials were told (p = {p:.2g})"
