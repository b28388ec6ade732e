"""Emulated hardware as programs of their own."""
