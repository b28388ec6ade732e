"""What sets a robot apart from its model: one module per effect, with its settings beside a function of numbers."""
