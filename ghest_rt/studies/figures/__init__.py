"""Figures of the studies, in publication quality."""
