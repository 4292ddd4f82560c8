"""From a demonstration and an observation to an action.

Read `one_shot.py` first: it watches, routes, matches and moves the demonstrated pose. `matcher.py` says what
a matcher is; `registration.py` is the one without learning.
"""
