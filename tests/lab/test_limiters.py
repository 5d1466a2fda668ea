"""The counts of the lab's card of limiters."""

from study_app.haptics.model import layout
from study_app.lab.live import LimiterCounts


def test_a_limiter_acts_only_now_and_is_counted_for_ten_seconds() -> None:
    counts = LimiterCounts()

    def states() -> dict[str, tuple[int, bool]]:
        rows = counts.rows(8.0, 1.5)
        assert [row.name.partition(",")[0] for row in rows] == [it.label for it in layout.LIMITERS]
        return {row.name: (row.ticks, row.acting) for row in rows if row.ticks}

    def add(seconds: float, *limiters: int) -> None:
        samples = layout.records(layout.SAMPLE, len(limiters))
        samples.time_ns = round(seconds * 1e9)
        samples.limiters = limiters
        counts.add(samples)

    assert states() == {}
    add(1.0, layout.LIMITER_NORM | layout.LIMITER_SLEW, layout.LIMITER_NORM, 0)
    assert states() == {"Slew, 1.5 N per tick": (1, True), "Force, 8 N": (2, True)}
    add(1.1, 0)
    assert states() == {"Slew, 1.5 N per tick": (1, True), "Force, 8 N": (2, True)}
    add(5.0, layout.LIMITER_SLEW)
    assert states() == {"Slew, 1.5 N per tick": (2, True), "Force, 8 N": (2, False)}
    add(11.5, 0)
    assert states() == {"Slew, 1.5 N per tick": (1, False)}
    add(14.999, layout.LIMITER_NORM)
    assert states() == {"Slew, 1.5 N per tick": (1, False), "Force, 8 N": (1, True)}
    add(15.0)
    assert states()["Slew, 1.5 N per tick"] == (1, False), "no samples"
    add(15.0, 0)
    assert states() == {"Force, 8 N": (1, True)}, "10 s after the slew"
    add(15.148, 0)
    assert states() == {"Force, 8 N": (1, True)}
    add(15.149, 0)
    assert states() == {"Force, 8 N": (1, False)}, "150 ms after the force"
