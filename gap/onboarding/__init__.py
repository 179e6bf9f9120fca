"""The first hour with measurements of one's own: a campaign from run files, a look at it, and all of it in one file."""
