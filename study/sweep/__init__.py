"""Many runs of any SSP package: which cases, what is measured of each, and what the table of all of them says."""
