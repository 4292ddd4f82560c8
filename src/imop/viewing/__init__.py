"""See what the policy understood: a demonstration beside a scene, what was matched, and what would be done.

`look` holds what there is to see, `draw` makes shapes of it, `window` shows them in a browser. `session` is
what the buttons do: it asks a decider (`deciders`) about a world (`worlds`).
"""
