"""What the study designer shows, as values. No Qt here."""
