"""`ghest-rt doctor`: what is there, what is missing, what to do."""
