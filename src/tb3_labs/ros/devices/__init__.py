"""Keyboard and mouse of this computer."""
