"""Accuracy of markers and arm: Tables 5 and 6 and Figure 13."""
