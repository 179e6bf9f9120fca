"""The source paper's figures and tables as code."""
