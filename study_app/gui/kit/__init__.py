"""What every window is made of: descriptions of fields and commands, and the widgets made from them."""
