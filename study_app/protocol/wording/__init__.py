"""The participant's texts in five languages."""
