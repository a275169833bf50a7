"""One prepared node on the stage: what was done to it, and what was seen, as one Observation."""
