"""Template of a device for liquid-study."""
