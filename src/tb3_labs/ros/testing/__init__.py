"""How are nodes started, watched and measured from outside? For the demonstration, the marking, the
tests and the benchmarks."""
