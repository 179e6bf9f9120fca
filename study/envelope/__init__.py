"""How far a design goes, and what is the cheapest change that makes it go further."""
