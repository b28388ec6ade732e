"""The page that explains by play: the project's own model and laws in a browser, translated into JavaScript."""
