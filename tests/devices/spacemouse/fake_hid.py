"""A fake of hidapi with devices."""

import threading
from typing import Any

from study_app.devices.spacemouse.hid import MODELS

MODEL = {model.name: model for model in MODELS}
HELD_S = 0.008


def interface(
    model: str = "SpaceNavigator", path: bytes = b"first", usage: tuple[int, int] | None = (1, 8)
) -> dict[str, Any]:
    known = MODEL[model]
    usage_fields = {} if usage is None else {"usage_page": usage[0], "usage": usage[1]}
    return {"vendor_id": known.vendor, "product_id": known.product, "path": path, **usage_fields}


class FakeHid:
    """A fake of hidapi with connected devices; an opened device sends given reports 8 ms apart."""

    def __init__(self, *reports: Any, listed: Any = None, opens: bool = True) -> None:
        self.reports = list(reports)
        self.listed = [interface()] if listed is None else listed
        self.opens = opens
        self.now = 0.0
        self.written: list[bytes] = []
        self.path: bytes | None = None
        self.open_count = 0
        self.idle, self.gone = threading.Event(), threading.Event()

    def say(self, report: bytes) -> None:
        """Send a report, and wait until it has been read."""
        self.idle.clear()
        self.reports.append(report)
        assert self.idle.wait(10)

    def now_s(self) -> float:
        return self.now

    def enumerate(self) -> Any:
        return self.listed

    def device(self) -> "FakeHid":
        return self

    def open_path(self, path: bytes) -> None:
        if not self.opens:
            raise OSError("open failed")
        self.path = path
        self.open_count += 1

    def read(self, size: int, timeout_ms: float) -> list[int]:
        assert size >= 13
        if self.gone.is_set():
            raise OSError("read error")
        if not self.reports:
            self.idle.set()
            self.gone.wait(timeout_ms / 1000)
            return []
        report = self.reports.pop(0)
        self.now += HELD_S
        return list(report)

    def write(self, data: bytes) -> int:
        self.written.append(bytes(data))
        return len(data)

    def close(self) -> None:
        self.open_count -= 1
