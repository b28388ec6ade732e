"""Benchmarks on this machine: ratios measured side by side in one run."""
