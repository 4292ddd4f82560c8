"""Demonstrations: finding keyframes, reading RLBench's files, storing and checking."""
