"""Helpers of the launch files."""
