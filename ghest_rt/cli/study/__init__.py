"""`ghest-rt study`: the tables and figures of the evaluation, made from nothing."""
