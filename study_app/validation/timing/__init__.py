"""How late the servo's turns begin: beside a bare loop on the same clock, a Python thread and a Qt timer."""
