"""Vendor code in a process of its own: it can hang or crash there without taking the service along."""
