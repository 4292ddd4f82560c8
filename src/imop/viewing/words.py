"""A decision in words, as Markdown."""

from imop.viewing.look import Look


def report(look: Look) -> str:
    """Which step is transferred, how sure that is, what would be done, and what is in the way of it."""
    lines = []
    action, match = look.action, None if look.action is None else look.action.match
    if action is not None:
        origin = "" if match is None else f"Step **{match.step + 1}** of the demonstration, "
        by = "" if match is None or not match.generator else f"by *{match.generator}*, "
        lines.append(f"{origin}{by}right with **{action.confidence:.0%}**.")
        touching = " It may touch things." if action.allow_collisions else ""
        p = ", ".join(f"{value:.3f}" for value in action.T_world_gripper[:3, 3])
        lines.append(f"To ({p}) m, then {'open' if action.gripper_open else 'close'}.{touching}")
        if action.reachable is False:
            lines.append("**The arm cannot reach it.**")
    if look.problem:
        lines.append(f"**{look.problem}**")
    return "\n\n".join(lines)
