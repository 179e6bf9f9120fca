"""The source paper's whole study: its runs, figures, claims, and a report of what holds."""
