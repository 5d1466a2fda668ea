"""The Lab Streaming Layer on this computer alone, apart from all other streams: for measurements and tests."""

import atexit
import os
import tempfile
from functools import cache
from pathlib import Path
from typing import Final

_VARIABLE: Final = "LSLAPICFG"
_FILE: Final = """[multicast]
ResolveScope = machine
[lab]
KnownPeers = {{127.0.0.1}}
SessionID = liquid-study-{process}
[log]
level = -2
"""


@cache
def localhost_only() -> Path:
    """Restrict LSL to this computer for this process and its children; return the configuration file.

    Call it before the library is loaded.
    """
    descriptor, name = tempfile.mkstemp(prefix="liquid-study-lsl-", suffix=".cfg")
    path = Path(name)
    with os.fdopen(descriptor, "w", encoding="utf-8") as file:
        file.write(_FILE.format(process=os.getpid()))
    atexit.register(path.unlink, missing_ok=True)
    os.environ[_VARIABLE] = str(path)
    return path
