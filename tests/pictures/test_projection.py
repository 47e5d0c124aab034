"""From space to the page: directions of view, scale and depth."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.errors import InputError
from multibody_sym.pictures.page.picture import PAGE_HEIGHT, WIDTH, Projection, view_of

FRONT = Projection((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), flat=True)


def test_the_usual_view_is_taken_where_none_is_asked_for() -> None:
    assert view_of(None, FRONT) is FRONT


@pytest.mark.parametrize(
    ("name", "toward"),
    [("front", (0, 0, 1)), ("back", (0, 0, -1)), ("top", (0, 1, 0)), ("right", (1, 0, 0)), ("left", (-1, 0, 0))],
)
def test_named_views_look_from_where_they_say(name: str, toward: tuple) -> None:
    assert view_of(name, FRONT).toward == pytest.approx(toward)


def test_the_front_is_upright_whatever_points_up() -> None:
    view = view_of("front", FRONT, upward=(0, 0, 1))
    assert view.page([[0, 0, 2.0]]) == pytest.approx(np.array([[0, 2.0]]))
    assert view.toward == pytest.approx([0, -1, 0])


def test_an_isometric_view_shortens_all_three_axes_alike() -> None:
    lengths = np.linalg.norm(view_of("iso", FRONT).page(np.eye(3)), axis=1)
    assert lengths == pytest.approx(np.full(3, np.sqrt(2 / 3)))


@pytest.mark.parametrize("asked", ["30,20", "30, 20", (30, 20), "30 20"])
def test_azimuth_and_elevation_are_degrees(asked: object) -> None:
    view = view_of(asked, FRONT)
    c, s = np.cos(np.radians(20)), np.sin(np.radians(20))
    assert view.toward == pytest.approx([c * np.sin(np.radians(30)), s, c * np.cos(np.radians(30))])
    assert np.linalg.norm(view.toward) == pytest.approx(1)


def test_a_view_along_the_plane_of_motion_is_not_flat() -> None:
    assert view_of("front", FRONT, plane=(0, 0, 1)).flat
    assert not view_of("top", FRONT, plane=(0, 0, 1)).flat


@pytest.mark.parametrize("asked", ["topp", "", "1,2,3", "nan,0", "0,91", (1,), (None, 2), "inf,0"])
def test_odd_views_are_refused(asked: object) -> None:
    with pytest.raises(InputError, match="view"):
        view_of(asked, FRONT)


def test_the_scale_fills_the_page_in_its_longer_direction() -> None:
    wide = FRONT.scaled(np.array([[0, 0, 0], [10.0, 1, 5]]))
    assert wide.scale == pytest.approx(WIDTH / 10)
    tall = FRONT.scaled(np.array([[0, 0, 0], [0.0, 2, 5]]))
    assert tall.scale == pytest.approx(PAGE_HEIGHT / 2)
    assert FRONT.scaled(np.zeros((1, 3))).scale > 0
    assert FRONT.scaled(np.zeros((0, 3))).scale > 0


def test_what_is_towards_the_reader_is_nearer() -> None:
    assert FRONT.depth([[0, 0, 1.0], [0, 0, -1.0]]) == pytest.approx([1, -1])
