"""The servo for hours or days with every kind of fault: drift, leaks and failures."""
