"""An outlet: every marker as a UDP datagram, to ``udp:HOST:PORT``."""

import socket

from study_app.errors import OutletError
from study_app.outlets.markers import SinkKind


class Datagrams:
    """Sends the text of each marker; a thread of the session calls it, and nobody waits for it."""

    title = "UDP markers"
    listens = None  # whether a program receives them is unknown

    def __init__(self, place, now_ns) -> None:
        host, _, port = place.rpartition(":")
        if not host or not port.isdecimal():
            raise OutletError(f"udp:{place} is no address: write udp:HOST:PORT")
        self._to = (host, int(port))
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    @property
    def described(self):
        """What the receipt records of it."""
        return {"address": f"{self._to[0]}:{self._to[1]}"}

    def send(self, marker) -> None:
        """Send a marker; an OSError ends the outlet, not the session."""
        self._socket.sendto(marker.text.encode(), self._to)

    def close(self) -> None:
        """Release the socket."""
        self._socket.close()


UDP = SinkKind("udp", Datagrams.title, example="udp:127.0.0.1:9000", open=Datagrams)
