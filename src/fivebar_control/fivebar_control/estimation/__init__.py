"""What is inferred from measurements."""
