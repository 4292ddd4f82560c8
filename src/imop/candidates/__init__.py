"""Candidates of every generator, judged by evidence and one learned verification.

This is to replace the special cases of `imop.policy`; until it is better everywhere it stands beside them as
the method `verified`.
"""
