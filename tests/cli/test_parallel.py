"""Cases of a command: Ctrl+C keeps what is finished, and the same command continues with it."""

import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from tests.workers.worker_cases import draw

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="signals to a group of processes are of POSIX"),
]

CASES = 40
FINISHED = 20
COMMAND = f"""
    import signal, sys
    from study_app.cli.options import executor_for
    from study_app.workers.executors import Workers
    from tests.workers.worker_cases import draw_or_wait
    if __name__ == "__main__":
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
        try:
            with executor_for(Workers(2)) as executor:
                for result in executor.map(draw_or_wait, range({CASES})):
                    print(result.hex(), flush=True)
        except KeyboardInterrupt:
            sys.exit(130)
"""


def started(cache: Path, wait_from: int) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(COMMAND)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        cwd=Path(__file__).parents[2],
        env={**os.environ, "LIQUID_STUDY_CACHE": str(cache), "WAIT_FROM": str(wait_from)},
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_or_killed_command_keeps_its_cases_and_the_next_start_computes_the_others(
    tmp_path: Path, number: signal.Signals
) -> None:
    expected = [draw(seed).hex() for seed in range(CASES)]
    first = started(tmp_path, FINISHED)
    assert first.stdout is not None
    assert [first.stdout.readline().strip() for _ in range(FINISHED)] == expected[:FINISHED]
    os.killpg(first.pid, number)
    out, err = first.communicate(timeout=60)
    if number == signal.SIGINT:
        assert (out, first.returncode) == ("", 130)
        assert err == f"finished cases kept: {FINISHED}; the same command continues with them\n"
    out, err = (second := started(tmp_path, CASES)).communicate(timeout=60)
    assert (out.split(), second.returncode) == (expected, 0)
    what, many = err.split(":")
    assert what == "cases finished by an earlier start"
    assert int(many) >= FINISHED - (number == signal.SIGKILL)  # the last one may have been printed before it was stored
    out, err = (third := started(tmp_path, CASES)).communicate(timeout=60)
    assert (out.split(), err, third.returncode) == (expected, "", 0)
