"""What was measured and what the model could lack: campaign.toml, its run files, effects.toml."""
