"""What the tab Measures shows, and the cards below the other tabs."""
