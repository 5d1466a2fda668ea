"""How late the servo's ticks begin, compared with a bare loop on the same clock, a Python thread and a Qt timer."""
