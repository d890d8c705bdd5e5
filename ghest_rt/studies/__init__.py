"""Evaluation: how far the estimates are from the truth, with the paper's metrics (3.4.2)."""
