"""The arms in MuJoCo, as the robosuite package models them: iiwa 7."""

import importlib.util
import pathlib
import sys

import mujoco
import numpy as np

from arms import (
    ARMS, BASE, FAR, FRICTION, JOINTS, NO_PAYLOAD, PARKED, PAYLOAD_AT, PAYLOAD_RADIUS, PHYSICS, ROTOR, STEPS, TABLE,
    TOOL,
)


class MuJoCo:
    """The physics of the cell in MuJoCo."""

    def __init__(self) -> None:
        self.model = build()
        self.data = mujoco.MjData(self.model)
        self.state = {
            arm: np.array([self.model.joint(f"{arm}_joint_{i + 1}").qposadr[0] for i in range(JOINTS)]) for arm in ARMS
        }
        self.speed = {
            arm: np.array([self.model.joint(f"{arm}_joint_{i + 1}").dofadr[0] for i in range(JOINTS)]) for arm in ARMS
        }
        self.motors = {
            arm: np.array([self.model.actuator(f"{arm}_torq_j{i + 1}").id for i in range(JOINTS)]) for arm in ARMS
        }
        self.site = {arm: self.model.site(f"{arm}_tool").id for arm in ARMS}
        self.payload = {arm: self.model.body(f"{arm}_payload").id for arm in ARMS}
        moving = {arm: solid(self.model, arm) for arm in ARMS}
        self.pairs = np.array([(a, b) for a in moving["left"] for b in moving["right"]])
        self.reach = self.model.geom_rbound[self.pairs].sum(axis=1)
        self.set_friction(1.0)
        self.reset()

    def reset(self) -> None:
        mujoco.mj_resetData(self.model, self.data)
        for arm in ARMS:
            self.data.qpos[self.state[arm]] = PARKED
        mujoco.mj_forward(self.model, self.data)

    def set_payload(self, mass: float) -> None:
        for body in self.payload.values():
            self.model.body_mass[body] = max(mass, NO_PAYLOAD)
            self.model.body_inertia[body] = max(mass, NO_PAYLOAD) * PAYLOAD_RADIUS**2

    def set_friction(self, factor: float) -> None:
        self.model.dof_damping[:] = np.tile(FRICTION, len(ARMS)) * factor

    def push(self, arm: str, torques: np.ndarray) -> None:
        self.data.ctrl[self.motors[arm]] = torques

    def step(self) -> None:
        mujoco.mj_step(self.model, self.data, STEPS)
        mujoco.mj_forward(self.model, self.data)

    def hold(self) -> None:
        self.data.qvel[:] = 0.0
        mujoco.mj_forward(self.model, self.data)

    def position(self, arm: str) -> list[float]:
        return self.data.qpos[self.state[arm]].tolist()

    def velocity(self, arm: str) -> list[float]:
        return self.data.qvel[self.speed[arm]].tolist()

    def tool(self, arm: str) -> np.ndarray:
        return self.data.site_xpos[self.site[arm]]

    def distance(self) -> float:
        """Spheres around the bodies tell which pairs can be the closest; the exact distance is computed for those."""
        middles = self.data.geom_xpos[self.pairs]
        at_least = np.linalg.norm(middles[:, 0] - middles[:, 1], axis=1) - self.reach
        smallest = FAR
        for pair in np.argsort(at_least, kind="stable"):
            if at_least[pair] >= smallest:
                break
            a, b = self.pairs[pair]
            smallest = min(smallest, mujoco.mj_geomDistance(self.model, self.data, a, b, smallest, None))
        return smallest


def build() -> mujoco.MjModel:
    """The model of the cell, from the arm that the robosuite package carries."""
    found = importlib.util.find_spec("robosuite")
    if found is None:
        sys.exit("cell.py: the package robosuite, which has the model of the arm, is not installed: run set_up.py")
    arm_file = pathlib.Path(found.submodule_search_locations[0]) / "models/assets/robots/iiwa/robot.xml"
    world = mujoco.MjSpec()
    world.option.timestep = PHYSICS
    world.worldbody.add_geom(name="table", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[0, 0, -TABLE[2]], size=TABLE)
    radius, length, mass = TOOL
    for arm in ARMS:
        spec = mujoco.MjSpec.from_file(str(arm_file))
        hand = spec.body("right_hand")
        hand.add_geom(
            name="tool_collision",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            pos=[0, 0, length / 2],
            size=[radius, length / 2, 0],
            mass=mass,
        )
        hand.add_site(name="tool", pos=[0, 0, length])
        payload = hand.add_body(name="payload", pos=[0, 0, PAYLOAD_AT])
        payload.mass, payload.inertia, payload.explicitinertial = NO_PAYLOAD, [1e-7] * 3, True
        x, y, turned = BASE[arm]
        frame = world.worldbody.add_frame(pos=[x, y, 0], quat=[np.cos(turned / 2), 0, 0, np.sin(turned / 2)])
        frame.attach_body(spec.worldbody.first_body(), f"{arm}_", "")
    for body in world.bodies:
        # The drives of a real iiwa carry the arm's own weight; not that of the payload.
        body.gravcomp = 0.0 if body.name.endswith("payload") else 1.0
    for joint in world.joints:
        joint.armature = ROTOR
    for geom in world.geoms:
        # An arm touches the other one and the table, not itself; what is only for the eye touches nothing.
        drawn = geom.name.endswith("_visual")
        geom.contype = 0 if drawn else 2 if geom.name.startswith("right") else 1
        geom.conaffinity = 0 if drawn else 1 if geom.name.startswith("right") else 2
    return world.compile()


def solid(model: mujoco.MjModel, arm: str) -> list[int]:
    """The bodies of an arm that can be hit: all but its base, which does not move."""
    names = [f"{arm}_link_{i}_collision" for i in range(1, JOINTS + 1)] + [f"{arm}_tool_collision"]
    return [model.geom(name).id for name in names]
