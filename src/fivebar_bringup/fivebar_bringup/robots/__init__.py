"""Robot files that are made from answers to questions."""
