"""An environment of Gymnasium (`pip install gymnasium`): a cart that keeps its pole upright."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

import multibody_sym as mbs

MODEL = Path(__file__).parent.parent / "cart_pole.yaml"


class CartPole(gymnasium.Env[np.ndarray, np.ndarray]):
    """State (x, theta, x', theta') in m and rad, pushed by up to 10 N, 50 times a second; 1 for each step upright."""

    observation_space = Box(-np.inf, np.inf, (4,), np.float64)
    action_space = Box(-10.0, 10.0, (1,))

    def __init__(self) -> None:
        self.sim = mbs.prepare(mbs.load(MODEL), method="rk4", step="5 ms").stepper("20 ms")

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed)
        self.sim.reset(initial={"theta": np.pi / 2 + self.np_random.uniform(-0.1, 0.1)}, inputs=[0.0])
        return self.sim.x, {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        self.sim.step(action)
        fallen = bool(abs(self.sim["theta"] - np.pi / 2) > 0.5 or abs(self.sim["x"]) > 2.4)
        return self.sim.x, 1.0, fallen, self.sim.t > 9.999, {}


if __name__ == "__main__":
    environment, gains = CartPole(), np.array([1.0, -35.0, 2.0, -10.0])
    state, _ = environment.reset(seed=0)
    steps, over = 0, False
    while not over:
        state, _, fallen, late, _ = environment.step(gains @ (state - [0.0, np.pi / 2, 0.0, 0.0]) * np.ones(1))
        steps, over = steps + 1, fallen or late
    print(f"upright for {steps} steps of 20 ms, the cart at {state[0]:.2f} m")
