"""How are angles, poses and sorted times computed? This folder knows nothing about robots."""
