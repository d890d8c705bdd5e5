"""Benchmarks: `python -m benchmarks.run`. Kept apart from the tests."""
