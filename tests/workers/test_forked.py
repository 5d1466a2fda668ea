import os
import sys
import threading

import pytest

from study_app.workers.forked import Forked


@pytest.fixture
def without_other_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threading, "active_count", lambda: 1)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks")
def test_the_result_comes_from_another_process(without_other_threads: None) -> None:
    names, pid = Forked(lambda: ({"figure": b"\x89PNG" * 100_000}, os.getpid())).result()
    assert names == {"figure": b"\x89PNG" * 100_000}
    assert pid != os.getpid()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks")
def test_a_process_that_dies_is_replaced(without_other_threads: None) -> None:
    here = os.getpid()
    assert Forked(lambda: 17 if os.getpid() == here else os._exit(9)).result() == 17


def test_a_program_with_threads_is_not_forked() -> None:
    end = threading.Event()
    other = threading.Thread(target=end.wait)
    other.start()
    try:
        assert Forked(os.getpid).result() == os.getpid()
    finally:
        end.set()
        other.join()
