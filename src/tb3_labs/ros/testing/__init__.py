"""Watches nodes from outside: for the demonstration, the marking, the tests and the benchmarks."""
