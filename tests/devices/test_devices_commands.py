"""``liquid-study devices``: list, doctor and calibrate, as they are typed."""

import json
import os
import subprocess
import sys
from types import SimpleNamespace

import click
import numba
import pytest
from click.testing import CliRunner

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.cli import commands
from study_app.cli.devices import Terminal, _ask_operator
from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.devices.falcon.calibration import calibration_file, load_calibration
from study_app.devices.falcon.failures import FAILURES, UDEV_RULE
from study_app.devices.registry import list_devices

pytestmark = pytest.mark.slow


def liquid_study(*words, **options):
    return CliRunner().invoke(commands, ["devices", *words], **options)


@pytest.mark.parametrize("words", [(), ("list",)])
def test_the_list_states_the_abilities_of_every_device(words):
    result = liquid_study(*words)
    assert result.exit_code == 0
    for name in list_devices():
        assert f"\n{name} " in "\n" + result.output
    assert "visual only, no force" in result.output
    assert "libusb" in result.output


class TestDoctor:
    def test_modes_stand_in_their_order_with_cause_and_cure(self):
        result = liquid_study("doctor", "--device", "falcon-emulated", "--fault", "never-homes")
        assert result.exit_code == 3
        rows = [line for line in result.output.splitlines() if line[:2].strip().isdigit()]
        assert "FAULT" in rows[0]
        for state in ("not checked", " ok "):
            numbers = [int(row[:2]) for row in rows if state in row]
            assert numbers == sorted(numbers)
        assert len(rows) == len(FAILURES.modes)
        sections = result.output.split("FAULT")
        assert len(sections) == 2
        assert "homing fails" in sections[1]
        assert "cause: not every arm has passed its index" in sections[1]
        assert "cure: push the grip in as far as it goes" in sections[1]

    def test_the_rule_to_paste_stands_in_one_line(self, monkeypatch):
        monkeypatch.setattr("sys.platform", "linux")
        result = liquid_study("doctor", "--device", "falcon-emulated", "--fault", "access-denied")
        assert result.exit_code == 3
        assert f"\necho '{UDEV_RULE}' | sudo tee /etc/udev/rules.d/60-falcon.rules && " in result.output

    def test_a_device_without_wires_is_not_looked_at(self):
        refused = liquid_study("doctor", "--device", "scripted")
        assert "the doctor command does not support 'scripted'" in str(refused.exception)

    @pytest.mark.parametrize(
        ("fault", "words"),
        [
            ("dropp=0.1", "choose one of: drop, truncate"),
            ("drop=1.5", "must be from 0 to 1, not 1.5"),
            ("drop", "not known; choose from: drop=CHANCE"),
            ("never", "never-homes, "),
            ("frozen=1", "cannot occur at random"),
            ("", "not known"),
        ],
    )
    def test_an_unknown_fault_is_refused(self, fault, words):
        refused = liquid_study("doctor", "--device", "falcon-emulated", "--fault", fault)
        assert words in str(refused.exception)


class TestTheTerminal:
    @pytest.fixture
    def pipe(self):
        reading, writing = os.pipe()
        with os.fdopen(writing, "wb", buffering=0) as typing:
            yield Terminal(reading), typing
        os.close(reading)

    def until(self, answered):
        while (answer := answered()) is None:
            pass
        return answer

    def test_an_answer_is_a_line_and_its_end_gives_up(self, pipe, capsys):
        terminal, typing = pipe
        answered = terminal.ask("reading", "What did it show?")
        assert answered() is None
        typing.write(b" 41")
        typing.write(b"2 \r\n\n")
        assert self.until(answered) == "412"
        assert self.until(terminal.ask("hang", "Hang it.")) == ""
        assert capsys.readouterr().out == "What did it show?\nHang it. Then press Enter.\n"
        typing.close()
        with pytest.raises(click.Abort):
            self.until(answered)

    def test_at_the_bench_enter_answers_only_the_question_to_let_go(self):
        terminal = SimpleNamespace(ask=lambda kind, _words: kind)
        assert [_ask_operator(terminal)(kind, "") for kind in ("let-go", "hang")] == ["let-go", "reading"]


class TestCalibrate:
    def test_the_calibration_of_an_emulated_falcon_is_stored_under_its_serial_number(self, tmp_path):
        result = liquid_study("calibrate", "--device", "falcon-emulated", "--grams", "400")
        assert result.exit_code == 0, result.output
        assert "Hang the 400 g weight" in result.output
        assert "motor units per newton metre" in result.output
        assert len([line for line in result.output.splitlines() if " +0.0" in line or " -0.0" in line]) >= 20
        file = calibration_file("EMULATED-WEIGHED")
        assert str(file) in result.output
        assert json.loads(file.read_text("utf-8"))["poses"] == 20
        assert load_calibration("EMULATED-WEIGHED").units_per_nm == pytest.approx(6616, rel=0.01)
        assert load_calibration("EMULATED") is None  # rehearsals do not use it

    @pytest.mark.usefixtures("falcon_socket")
    @pytest.mark.skipif(os.name == "nt", reason="no Unix sockets")
    def test_an_operator_who_goes_away_ends_it_without_torque(self, tmp_path):
        from tests.devices.falcon.served import Server

        emulator = Emulator(running=True)
        with Server(tmp_path / "falcon", emulator):
            words = ["devices", "calibrate", "--device", f"falcon-socket:{tmp_path / 'falcon'}", "--grams", "400"]
            command = [sys.executable, "-m", "study_app", *words]
            ended = subprocess.run(command, input="", capture_output=True, text=True, check=False)
        assert ended.returncode == 130, ended.stderr
        assert ended.stderr == ""
        assert "Let go of the grip" in ended.stdout
        assert emulator.torques == (0, 0, 0)

    @pytest.mark.parametrize("words", [(), ("--grams", "400", "--scale"), ("--grams", "4000"), ("--grams", "heavy")])
    def test_unusable_weights_are_refused_at_once(self, words):
        assert liquid_study("calibrate", "--device", "falcon-emulated", *words).exit_code == 2

    def test_only_a_falcon_is_calibrated(self):
        assert "cannot be calibrated: specify a Falcon" in str(
            liquid_study("calibrate", "--device", "mouse", "--grams", "400").exception
        )
        refused = liquid_study("calibrate", "--device", "falcon-emulated", "--scale")
        assert "--grams" in str(refused.exception)
