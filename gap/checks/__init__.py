"""What betrays a campaign that was written down wrongly, before anything is searched for."""
