"""The embedded robots on the topics of real ones."""
