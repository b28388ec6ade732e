"""What people run: the scenarios, the `fivebar` command, the bag recorder and the reports."""
