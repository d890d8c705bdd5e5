"""The sensitivity analysis: section 3.5 of the paper, and what it leaves out."""
