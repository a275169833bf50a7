"""What do the numbers mean? This folder computes with angles, quaternions, poses in the plane and
sorted times, and does not know robots."""
