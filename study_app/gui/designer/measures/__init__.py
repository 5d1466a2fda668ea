"""The tab Measures, and the cards below the other tabs."""
