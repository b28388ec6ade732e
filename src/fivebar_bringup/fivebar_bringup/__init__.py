"""Launch files, scenarios, the fivebar command, the bag recorder and the reports of the five-bar robot."""
