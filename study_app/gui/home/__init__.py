"""Home: the studies, the recorded sessions, and the start of the next one."""
