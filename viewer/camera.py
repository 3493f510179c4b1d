"""The camera in the hand: orbit, pan, zoom."""

from __future__ import annotations

import numpy as np

from ..lab import scenes
from .state import State

STEEPEST = 0.995  # of the cosine to up, so that the picture keeps an upper side
NEAREST, FARTHEST = 0.3, 200.0
MARGIN, WIDEST = 1.12, 0.7  # around an object, and of the tangent of half the angle of view


def orbit(state: State, right: float, up: float) -> None:
    """Turns the camera around its target, radians."""
    target = np.array(state.target)
    away = np.array(state.eye) - target
    distance = np.linalg.norm(away)
    azimuth, elevation = np.arctan2(away[0], away[2]) + right, np.arcsin(np.clip(away[1] / distance, -1, 1)) + up
    elevation = np.clip(elevation, -np.arcsin(STEEPEST), np.arcsin(STEEPEST))
    _move(state, target + distance * _direction(azimuth, elevation), target)


def pan(state: State, right: float, up: float) -> None:
    """Moves eye and target, in heights of the picture."""
    eye, target = np.array(state.eye), np.array(state.target)
    back = eye - target
    distance = np.linalg.norm(back)
    back /= distance
    x = np.cross(scenes.UP, back)
    x /= np.linalg.norm(x)
    shift = (right * x + up * np.cross(back, x)) * 2 * distance * np.tan(np.radians(state.fov) / 2)
    _move(state, eye + shift, target + shift)


def zoom(state: State, factor: float) -> None:
    """Multiplies the distance to the target."""
    target = np.array(state.target)
    away = np.array(state.eye) - target
    distance = np.linalg.norm(away)
    _move(state, target + away * np.clip(distance * factor, NEAREST, FARTHEST) / distance, target)


def reset(state: State, vertices, aspect: float) -> None:
    """The camera of the comparison's scenes, its angle such that the picture holds the whole object."""
    state.eye, state.target = scenes.EYE, scenes.TARGET
    x, y, z = basis(state) @ (np.asarray(vertices) - state.eye).T
    tangent = max(np.max(np.abs(y) / -z), np.max(np.abs(x) / -z) / aspect) if (z < 0).all() else WIDEST
    state.fov = float(np.degrees(2 * np.arctan(min(MARGIN * tangent, WIDEST))))


def turned(vector, right: float, up: float) -> tuple[float, float, float]:
    """A direction or position turned around the origin, as the camera by orbit."""
    vector = np.array(vector, float)
    length = np.linalg.norm(vector)
    azimuth, elevation = np.arctan2(vector[0], vector[2]) + right, np.arcsin(np.clip(vector[1] / length, -1, 1)) + up
    elevation = np.clip(elevation, -np.pi / 2, np.pi / 2)
    return _plain(length * _direction(azimuth, elevation))


def basis(state: State) -> np.ndarray:
    """Rows: right, up and back of the camera."""
    back = np.array(state.eye) - np.array(state.target)
    back /= np.linalg.norm(back)
    right = np.cross(scenes.UP, back)
    right /= np.linalg.norm(right)
    return np.array((right, np.cross(back, right), back))


def _direction(azimuth: float, elevation: float) -> np.ndarray:
    ring = np.cos(elevation)
    return np.array((ring * np.sin(azimuth), np.sin(elevation), ring * np.cos(azimuth)))


def _move(state: State, eye, target) -> None:
    state.eye, state.target = _plain(eye), _plain(target)


def _plain(vector) -> tuple[float, float, float]:
    return tuple(float(x) for x in vector)
