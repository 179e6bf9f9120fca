"""The FMUs: thin adapters over the physics, the project's pythonfmu base class, and the build."""
