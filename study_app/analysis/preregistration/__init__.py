"""What a study commits to before its first session, as a text and as values that the report compares with."""
