"""A session in its windows sends its events to a port and to the Lab Streaming Layer, and goes on without them."""

import os
import threading

import pytest

from study_app.gui.operator.window import OperatorWindow
from study_app.outlets.markers import CODES
from study_app.store import workstation
from study_app.store.verification.whole_study import verify_study
from study_app.store.workstation import MachineSettings
from tests.app.people import Person, events, receipt_of, run_attended, window
from tests.compiled import needs_servo

pytest.importorskip("pylsl", reason="pylsl is not installed: pip install 'liquid-study[lsl]'")
pytest.importorskip("serial", reason="pyserial is not installed: pip install 'liquid-study[triggers]'")

pytestmark = [
    pytest.mark.slow,
    needs_servo,
    pytest.mark.usefixtures("qapp", "nobody_stays", "quick_preflight"),
    pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no virtual ports"),
]


@pytest.fixture
def port():
    """Return both ends of a pair of virtual ports: a file to read from, and the name of the other."""
    import tty

    ours, theirs = os.openpty()
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    yield ours, os.ttyname(theirs)
    os.close(theirs)


@pytest.mark.nightly
def test_events_are_bytes_and_the_receipt_has_their_table(short_demo, results, port):
    ours, name = port
    workstation.save_settings(MachineSettings(lsl_markers=True, lsl_samples="single-blind", triggers=f"serial:{name}"))
    code, lines = run_attended(short_demo, results)
    assert code == 0
    came = [byte for byte in os.read(ours, 65536) if byte]
    os.close(ours)
    lines_written = events(results)
    assert came == [CODES[line["event"]] for line in lines_written if line["event"] in CODES]
    assert {CODES[event] for event in ("trial_started", "trial_ended", "responses", "session_ended")} < set(came)
    assert "outlet_lost" not in {line["event"] for line in lines_written}
    assert verify_study(results).is_sound
    outlets = receipt_of(results)["outlets"]
    assert set(outlets) == {"LSL markers", "Serial port"}
    assert outlets["Serial port"]["codes"] == dict(CODES)
    said = "\n".join(lines)
    assert "warning  LSL markers     no listener" in said
    assert "ok       LSL samples     off; because the study is double-blind" in said
    assert "ok       Serial port     ready" in said
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("outlet")]


def test_an_unplugged_port_is_reported_once_and_does_not_stop_the_session(short_demo, results, port):
    ours, name = port
    workstation.save_settings(MachineSettings(triggers=f"serial:{name}"))
    tally_texts: list[tuple[str, ...]] = []

    class Unplugger(Person):
        def look(self):
            operator = window(OperatorWindow)
            if not tally_texts and self.once is None and self.answered is not None:
                os.close(ours)
                tally_texts.append(())
            elif tally_texts and operator is not None and operator.rail.tally.beyond.text():
                tally_texts.append((operator.rail.tally.beyond.text(),))
            super().look()

    code, _ = run_attended(short_demo, results, Unplugger())
    assert code == 0
    lines_written = events(results)
    assert lines_written[-1]["status"] == "completed"
    lost = [(line["outlet"], line["reason"]) for line in lines_written if line["event"] == "outlet_lost"]
    assert len(lost) == 1
    assert lost[0][0] == "Serial port"
    assert lost[0][1].startswith(f"serial:{name} failed")
    assert any(text.startswith(f"Serial port: serial:{name} failed") for (text,) in tally_texts[1:])
    assert sum(line["event"] == "responses" for line in lines_written) == 4
    assert verify_study(results).is_sound
