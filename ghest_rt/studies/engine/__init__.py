"""Runs thousands of study tasks: described, cached by content, on this machine's cores or on a cluster."""
