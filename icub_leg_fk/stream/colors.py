"""The colour of a chain, in viewers and in pictures alike."""

from icub_leg_fk.kinematics import Chain

_SIDES = {
    'left': '#6a3d9a',
    'right': '#e08214',
}  # told apart in every kind of colour vision
_OTHERS = ('#00798c', '#8c6d31', '#a8437c')


def color_of(chain: Chain) -> str:
    """Return a chain's colour as #rrggbb: one for everything left, one for everything right."""
    for side, color in _SIDES.items():
        if side in chain.tip + chain.name:
            return color
    return _OTHERS[sum(map(ord, chain.name)) % len(_OTHERS)]
