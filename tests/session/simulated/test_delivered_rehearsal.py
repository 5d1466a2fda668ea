"""What check passes at its very limits is delivered as requested, and never clipped, on the paced scripted hand."""

from pathlib import Path

import pytest

from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.blinding import opened, read_key
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal
from tests.compiled import needs_servo
from tests.journal_lines import raw

pytestmark = needs_servo

HEAD = """\
format = 2
study.name = "limits"
scene = { scale = 3, fade_s = 0.3 }
[tasks.stir]
kind = "follow"
[methods.few]
kind = "constant"
levels = 2
repetitions = 1
"""
DAMPERS = """
[liquids.damper]
drag = { law = "linear", damping_nspm = 33 }
[stimuli.number]
vary = "damping_nspm"
levels = [0.02, 0.6]
[blocks.pairs]
stimulus = "number"
design = "2ifc"
method = "few"
"""
OILS = """
[liquids.oil]
density_kg_m3 = 1260
viscosity_pa_s = 4
effects = ["drag"]
drag = { law = "haider-levenspiel" }
[stimuli.number]
vary = "viscosity_pa_s"
level = "value"
levels = [0.5, 20]
[blocks.numbers]
stimulus = "number"
design = "estimation"
method = "few"
"""
DELAYS = """
[liquids.damper]
drag = { law = "linear", damping_nspm = 4 }
[stimuli.number]
vary = "delay_ms"
standards = [50]
levels = [10, 200]
[blocks.pairs]
stimulus = "number"
design = "2ifc"
method = "few"
"""


@pytest.mark.parametrize("tables", [DAMPERS, OILS, DELAYS], ids=["dampers", "oils", "delays"])
@pytest.mark.slow
def test_every_interval_is_delivered_as_requested(tmp_path: Path, tables: str) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(HEAD + tables, encoding="utf-8")
    study = rehearse(path, participants=1, seed=1, results=tmp_path / "results")
    session = StudyFolder(study).sessions()[0]
    lines = raw(opened(journal.read(session.journal), read_key(study)))
    intervals = [line for line in lines if line["event"] == "interval_ended"]
    assert intervals
    for line in intervals:
        assert "invalid" not in line
        assert line["limiter_norm"] == 0
        assert line["force_share"] == pytest.approx(1.0, abs=0.02)
        assert 0.0888 * 0.6 < line["pace_mps"] < 0.0888 * 1.4
        assert (line["value_delivered"] is None) == (tables is DELAYS)
    assert {line["outcome"] for line in lines if line["event"] == "trial_ended"} == {"complete"}
    assert replay(session.path).proved
