"""The report: one HTML file with every table and figure of the studies in a results folder, the paper's values beside ours."""
