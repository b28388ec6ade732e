"""What the project costs on this machine: ratios measured side by side in one run."""
