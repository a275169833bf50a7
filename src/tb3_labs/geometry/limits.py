"""Numbers kept within limits."""
import math


def clamp(value: float, low: float, high: float) -> float:
    """`value` clipped to [low, high]; NaN stays NaN (min and max would make it a limit)."""
    return value if math.isnan(value) else max(low, min(high, value))
