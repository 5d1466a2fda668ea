"""An emulated Falcon, independent of the driver: it shares the numbers of the wire and of the geometry, and no code."""
