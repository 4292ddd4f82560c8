"""Kinematics of any arm that MuJoCo can read, by mink: Newton's method, damped, within joint limits."""

import mujoco
import numpy as np
from scipy.stats import qmc

from imop.extras import extra
from imop.geometry import se3
from imop.types import FloatArray, as_array, as_pose

with extra("arms"):
    import mink

# As of the Panda's analytic solutions: metres and radians.
_POSITION_TOLERANCE, _ROTATION_TOLERANCE = 1e-5, 1e-4
_SEARCH_STEPS, _FOLLOW_STEPS = 40, 12
_STARTS = 14
"""Configurations that a search begins from, besides the reference and the home."""
_LARGEST_STEP, _DAMPING = 0.5, 1e-3
_PROGRESS, _PATIENCE = 0.9, 4
"""A search is given up after so many steps in which the error does not fall below this share."""
_SAME = 0.02
"""Solutions nearer to each other, radians, are one."""


class MinkKinematics:
    """Forward and inverse kinematics of one arm; what else the model has does not move.

    Args:
        model: with the arm.
        joints: names of its joints, in the order of the joint positions.
        tip: site of the gripper frame.
        home: (J,) radians.
        lower, upper: (J,) radians; narrower than the model's if wanted.
        T_world_model: (4, 4), where the model's world frame lies.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        joints: tuple[str, ...],
        tip: str,
        home: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        T_world_model: FloatArray,
    ):
        self._configuration = mink.Configuration(model)
        self._task = mink.FrameTask(tip, "site", position_cost=1.0, orientation_cost=1.0, lm_damping=1e-3)
        self._tip = tip
        self._q0 = self._configuration.q.copy()
        ids = [model.joint(name).id for name in joints]
        self._qpos, self._dof = model.jnt_qposadr[ids], model.jnt_dofadr[ids]
        self._home, self._lower, self._upper = home, lower, upper
        self._T_world_model = T_world_model
        corners = qmc.Halton(len(joints), scramble=False).random(_STARTS + 1)[1:]
        self._starts = lower + corners * (upper - lower)

    def tip_pose(self, q: FloatArray) -> FloatArray:
        """T_world_gripper (4, 4) for joints (J,), radians.

        Raises:
            InvalidInput: for another number of joints.
        """
        self._put(as_array("q", q, (len(self._home),)))
        return np.asarray(self._T_world_model @ self._T_model_tip())

    def inverse(
        self, T_world_gripper: FloatArray, q_reference: FloatArray, limit: int | None = None
    ) -> FloatArray:
        """Configurations with the tip at a pose, nearest to a reference first.

        They are found from several starts, so a pose at the edge of what the arm reaches may be missed.

        Args:
            T_world_gripper: (4, 4).
            q_reference: (J,) radians; the first start.
            limit: keep at most so many. With 1 the search ends at the first that is found.

        Returns:
            (n, J) radians within the joint limits; n = 0 if none was found.
        """
        T = as_pose("T_world_gripper", T_world_gripper)
        found: list[FloatArray] = []
        for start in (q_reference, self._home, *self._starts):
            q = self._solve(np.clip(start, self._lower, self._upper), T, _SEARCH_STEPS)
            if q is not None and all(np.abs(q - other).max() > _SAME for other in found):
                found.append(q)
                if limit == 1:
                    break
        if not found:
            return np.empty((0, len(self._home)))
        rows = np.stack(found)
        order = np.argsort(np.linalg.norm(rows - q_reference, axis=1), kind="stable")
        return np.asarray(rows[order][:limit])

    def follow(self, poses: FloatArray, q_start: FloatArray) -> FloatArray | None:
        """The continuous branch of solutions that starts at `q_start`.

        Args:
            poses: (n, 4, 4) close-by tip poses, to be reached one after another.
            q_start: (J,) radians, near the first pose.

        Returns:
            (n, J) radians, or None where the branch leaves the joint limits or ends.
        """
        rows, q = [], q_start
        for T in poses:
            solution = self._solve(q, T, _FOLLOW_STEPS)
            if solution is None:
                return None
            rows.append(q := solution)
        return np.stack(rows) if rows else np.empty((0, len(q_start)))

    def _solve(self, q: FloatArray, T_world_gripper: FloatArray, steps: int) -> FloatArray | None:
        target = se3.invert(self._T_world_model) @ T_world_gripper
        self._task.set_target(mink.SE3.from_matrix(target))
        best, since = float("inf"), 0
        for _ in range(steps):
            self._put(q)
            error = self._task.compute_error(self._configuration)
            off = np.linalg.norm(error[:3]), np.linalg.norm(error[3:])
            if off[0] < _POSITION_TOLERANCE and off[1] < _ROTATION_TOLERANCE:
                return q
            since = 0 if sum(off) < _PROGRESS * best else since + 1
            if since == _PATIENCE:
                return None
            best = min(best, float(sum(off)))
            J = self._task.compute_jacobian(self._configuration)[:, self._dof]
            # The task's Jacobian is that of its error, which is to vanish.
            step = -J.T @ np.linalg.solve(J @ J.T + _DAMPING**2 * np.eye(6), error)
            q = np.clip(q + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP), self._lower, self._upper)
        return None

    def _put(self, q: FloatArray) -> None:
        self._q0[self._qpos] = q
        self._configuration.update(self._q0)

    def _T_model_tip(self) -> FloatArray:
        return np.asarray(self._configuration.get_transform_frame_to_world(self._tip, "site").as_matrix())
