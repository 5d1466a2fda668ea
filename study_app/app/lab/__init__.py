"""The liquid lab: the window, the servo and the files behind it."""
