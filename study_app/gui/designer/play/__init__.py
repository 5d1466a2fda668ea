"""Playing from the designer: the buttons of the header, and the line below it."""
