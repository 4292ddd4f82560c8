"""What of a file our mechanics do not do, in words for whoever makes a task of it."""

from imop.tasks.coppelia.dynamics import is_moving_joint
from imop.tasks.coppelia.model import Dummy, Joint, Model
from imop.tasks.coppelia.parts import filled


def lacks(model: Model) -> list[str]:
    """One sentence for every kind of thing that will not be as in the program; none if all will."""
    joints = [o for i, o in enumerate(model.objects) if isinstance(o, Joint) and is_moving_joint(model, i)]
    linked = [o.name for o in model.objects if isinstance(o, Dummy) and o.linked >= 0]
    kinds = {
        "screws turn without rising": [j.name for j in joints if j.lead],
        "motors brake and do not drive": [
            j.name
            for j in joints
            if (j.motor == "velocity" and j.target_velocity and j.max_force) or j.motor == "position"
        ],
        "linked dummies do not hold together": linked,
        "shapes are not convex, coacd takes them apart": filled(model),
    }
    return [f"{what}: {', '.join(names)}" for what, names in kinds.items() if names]
