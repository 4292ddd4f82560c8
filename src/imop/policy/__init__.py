"""From a demonstration and an observation to an action.

Read `one_shot.py` first: it watches, routes, locates and moves the demonstrated pose. `interfaces.py` says
what a matcher is; `learned.py` asks the networks, `registration.py` does without learned matches. Both stand
before one search (`search.py`) and one verification (`verification.py`).
"""
