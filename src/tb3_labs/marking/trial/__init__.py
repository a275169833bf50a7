"""One prepared node in a trial: what was done to it, and what was seen, as one Observation."""
