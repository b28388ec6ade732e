"""How likely a motion is to succeed: robots drawn within their tolerances, run on the compiled engine."""
