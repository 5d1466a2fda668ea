"""What can wait: done when it is due and there is room, never for ever put off, never more than its share."""

from itertools import pairwise

from study_app.app.session.frame_budget import MOST_PERIODS, MOST_SHARE, FrameBudget

MS = 1_000_000


class Frame:
    """A clock turned by hand, and works that take their time."""

    def __init__(self, **works_ms):
        """Take name = (how often, how long it takes) [ms]."""
        self.now_ns = 0
        self.done = []
        self.takes_ms = {name: takes for name, (_, takes) in works_ms.items()}
        works = [(lambda name=name: self.do(name), every / 1000) for name, (every, _) in works_ms.items()]
        self.slack = FrameBudget(works, lambda: self.now_ns)

    def do(self, name):
        self.done.append((name, self.now_ns // MS))
        self.now_ns += round(self.takes_ms[name] * MS)

    def run(self, frames, every_ms, tank_ms):
        """Let frames come, each painted for so long; return how long works ran past the next one [ms]."""
        past = []
        start_ns = self.now_ns
        for number in range(frames):
            due_ns = start_ns + number * every_ms * MS
            self.now_ns = max(self.now_ns, due_ns) + tank_ms * MS
            self.slack.use(due_ns + every_ms * MS)
            past.append(max(0, self.now_ns - due_ns - every_ms * MS) / MS)
        return past

    def times(self, name):
        return [at for one, at in self.done if one == name]


def test_works_are_done_as_often_as_asked_where_there_is_room():
    frame = Frame(plot=(30, 2), table=(500, 1))
    past = frame.run(120, 16, 2)
    assert max(past) == 0
    assert len(frame.times("plot")) == 60
    assert len(frame.times("table")) == 4


def test_no_work_begins_that_would_run_into_the_next_frame_and_those_beside_it_wait_their_turn():
    frame = Frame(one=(30, 3), other=(30, 3))
    past = frame.run(100, 7, 2)
    assert max(past[2:]) == 0, "how long they take is known after the first time"
    frames = [at // 7 for _, at in frame.done[2:]]
    assert len(frames) == len(set(frames))
    assert min(len(frame.times(name)) for name in ("one", "other")) >= 18


def test_what_never_fits_is_done_now_and_then_all_the_same():
    frame = Frame(slow=(30, 9))
    frame.run(400, 7, 2)
    gaps = [late - early for early, late in pairwise(frame.times("slow"))]
    assert gaps
    assert max(gaps) <= (MOST_PERIODS + 1) * 30 + 9 / MOST_SHARE
    assert sum(9 for _ in frame.done) <= 1.1 * MOST_SHARE * 400 * 7


def test_of_what_waited_too_long_one_thing_is_done_at_a_time():
    frame = Frame(one=(30, 9), other=(30, 9))
    past = frame.run(400, 7, 2)
    assert max(past[2:]) <= 9
    assert min(len(frame.times(name)) for name in ("one", "other")) > 10


def test_a_work_that_took_long_once_comes_back_to_its_pace():
    frame = Frame(plot=(30, 40))
    frame.run(10, 16, 2)
    frame.takes_ms["plot"] = 1
    frame.run(600, 16, 2)
    late = frame.times("plot")[-10:]
    assert max(b - a for a, b in pairwise(late)) == 32
