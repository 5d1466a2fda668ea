"""The window of the designer: header, arrangement, file, and the controller of the open study."""
