"""Generated pages and schemas of the documentation."""
