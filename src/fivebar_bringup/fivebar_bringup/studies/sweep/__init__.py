"""Thousands of random crossings with every controller: how often they succeed, how large the errors are, what fails."""
