"""Shared by the studies."""
