"""The arms in PyBullet, as its own data models them: iiwa 14, some centimetres longer than the iiwa 7.

Bullet is another engine with other contacts and another integration, and somebody else described the arm. What MuJoCo
offers and Bullet does not is done as people do it in Bullet, which is not quite the same:

- Bullet knows no rotors of drives, so their inertia is part of the links.
- It computes the friction of drives from the speed before a step, MuJoCo from the one after it.
- It has no compensation of gravity. Here nothing has weight but the payload.
"""

import pathlib
import tempfile
import xml.etree.ElementTree as xml

import numpy as np
import pybullet
import pybullet_data

from arms import (
    ARMS, BASE, FAR, FRICTION, JOINTS, NO_PAYLOAD, PARKED, PAYLOAD_AT, PAYLOAD_RADIUS, PHYSICS, ROTOR, STEPS, TABLE,
    TOOL,
)

MODEL = pathlib.Path(pybullet_data.getDataPath()) / "kuka_iiwa/model.urdf"
FLANGE = 0.045  # metres from the last joint to the surface that carries the tool
STRONGEST = np.array([176.0, 176.0, 110.0, 110.0, 110.0, 40.0, 40.0])  # Nm
HAND, PAYLOAD = JOINTS, JOINTS + 1  # links behind those of the joints
GRAVITY = 9.81  # m/s²


class PyBullet:
    """The physics of the cell in PyBullet."""

    def __init__(self) -> None:
        self.client = pybullet.connect(pybullet.DIRECT)
        self.mass = 0.0
        self.friction = 1.0
        self.reset()

    def reset(self) -> None:
        """Loads everything again: Bullet keeps contacts of the past, which equal runs must not see."""
        client = {"physicsClientId": self.client}
        pybullet.resetSimulation(**client)
        pybullet.setTimeStep(PHYSICS, **client)
        pybullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1, **client)
        table = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=TABLE, **client)
        pybullet.createMultiBody(0, table, basePosition=(0, 0, -TABLE[2]), **client)
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "arm.urdf"
            file.write_text(with_tool())
            self.bodies = {arm: self.load(file, *BASE[arm]) for arm in ARMS}
        self.torques = {arm: np.zeros(JOINTS) for arm in ARMS}
        self.set_payload(self.mass)
        self.set_friction(self.friction)

    def load(self, file: pathlib.Path, x: float, y: float, turned: float) -> int:
        """An arm on the table, above its box."""
        client = {"physicsClientId": self.client}
        body = pybullet.loadURDF(
            str(file),
            (x, y, 0),
            pybullet.getQuaternionFromEuler((0, 0, turned)),
            useFixedBase=True,
            flags=pybullet.URDF_USE_INERTIA_FROM_FILE,  # otherwise Bullet guesses it from the shape
            **client,
        )
        for joint in range(JOINTS):
            inertia = np.array(pybullet.getDynamicsInfo(body, joint, **client)[2]) + (0.0, 0.0, ROTOR)
            pybullet.changeDynamics(body, joint, localInertiaDiagonal=inertia.tolist(), **client)
            pybullet.resetJointState(body, joint, PARKED[joint], **client)
        # Bullet holds each joint with a motor of its own until it is told not to.
        free = {"controlMode": pybullet.VELOCITY_CONTROL, "forces": [0.0] * JOINTS}
        pybullet.setJointMotorControlArray(body, range(JOINTS), **free, **client)
        return body

    def set_payload(self, mass: float) -> None:
        self.mass = mass
        heavy = max(mass, NO_PAYLOAD)
        for body in self.bodies.values():
            inertia = [heavy * PAYLOAD_RADIUS**2] * 3
            pybullet.changeDynamics(
                body, PAYLOAD, mass=heavy, localInertiaDiagonal=inertia, physicsClientId=self.client
            )

    def set_friction(self, factor: float) -> None:
        self.friction = factor
        for body in self.bodies.values():
            for joint in range(JOINTS):
                damping = FRICTION[joint] * factor
                pybullet.changeDynamics(body, joint, jointDamping=damping, physicsClientId=self.client)

    def push(self, arm: str, torques: np.ndarray) -> None:
        self.torques[arm] = np.clip(torques, -STRONGEST, STRONGEST)

    def step(self) -> None:
        for _ in range(STEPS):
            for arm, body in self.bodies.items():
                # Bullet forgets torques and forces after each step.
                pybullet.setJointMotorControlArray(
                    body,
                    range(JOINTS),
                    pybullet.TORQUE_CONTROL,
                    forces=self.torques[arm].tolist(),
                    physicsClientId=self.client,
                )
                if self.mass > 0.0:
                    weight = (0, 0, -self.mass * GRAVITY)
                    at = pybullet.getLinkState(body, PAYLOAD, physicsClientId=self.client)[0]
                    pybullet.applyExternalForce(
                        body, PAYLOAD, weight, at, pybullet.WORLD_FRAME, physicsClientId=self.client
                    )
            pybullet.stepSimulation(physicsClientId=self.client)

    def hold(self) -> None:
        for arm, body in self.bodies.items():
            for joint, position in enumerate(self.position(arm)):
                pybullet.resetJointState(body, joint, position, 0.0, physicsClientId=self.client)

    def position(self, arm: str) -> list[float]:
        return [state[0] for state in self.joints(arm)]

    def velocity(self, arm: str) -> list[float]:
        return [state[1] for state in self.joints(arm)]

    def joints(self, arm: str) -> list[tuple]:
        """What Bullet knows of the joints of an arm."""
        return pybullet.getJointStates(self.bodies[arm], range(JOINTS), physicsClientId=self.client)

    def tool(self, arm: str) -> np.ndarray:
        hand = pybullet.getLinkState(
            self.bodies[arm], HAND, computeForwardKinematics=True, physicsClientId=self.client
        )
        turned = np.array(pybullet.getMatrixFromQuaternion(hand[5])).reshape(3, 3)
        return np.array(hand[4]) + turned @ (0.0, 0.0, TOOL[1])

    def distance(self) -> float:
        points = pybullet.getClosestPoints(
            self.bodies["left"], self.bodies["right"], FAR, physicsClientId=self.client
        )
        # Bullet counts links from -1, the base.
        return min((point[8] for point in points if min(point[3:5]) >= 0), default=FAR)


def with_tool() -> str:
    """The description of the arm with the tool of this cell, and with a place where a payload hangs."""
    robot = xml.parse(MODEL).getroot()
    for mesh in robot.iter("mesh"):
        mesh.set("filename", str(MODEL.parent / mesh.get("filename")))
    radius, length, mass = TOOL
    across, along = mass * (3 * radius**2 + length**2) / 12, mass * radius**2 / 2
    cylinder = f'<collision><origin xyz="0 0 {length / 2}"/><geometry><cylinder radius="{radius}" length="{length}"/>'
    last = robot.findall("link")[-1].get("name")
    hand = link("hand", length / 2, mass, across, along, cylinder + "</geometry></collision>")
    payload = link("payload", 0.0, NO_PAYLOAD, 1e-7, 1e-7)
    for part in (hand, fixed(last, "hand", FLANGE), payload, fixed("hand", "payload", PAYLOAD_AT)):
        robot.append(xml.fromstring(part))
    return xml.tostring(robot, encoding="unicode")


def link(name: str, middle: float, mass: float, across: float, along: float, shape: str = "") -> str:
    """A link whose axis is that of the last joint."""
    inertia = f'<inertia ixx="{across}" iyy="{across}" izz="{along}" ixy="0" ixz="0" iyz="0"/>'
    inertial = f'<inertial><origin xyz="0 0 {middle}"/><mass value="{mass}"/>{inertia}</inertial>'
    return f'<link name="{name}">{inertial}{shape}</link>'


def fixed(parent: str, child: str, distance: float) -> str:
    """A joint that does not move."""
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 {distance}"/>'
    return f'<joint name="{child}" type="fixed">{ends}</joint>'
