"""From a recorded run to figures, a page and a summary."""
