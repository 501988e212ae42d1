"""URDFs made of a few joints, one after the other."""

from collections.abc import Sequence


def robot(joints: Sequence[str], links: int | None = None) -> str:
    """Return a URDF of links l0, l1 and so on, as many as its joints need."""
    count = len(joints) + 1 if links is None else links
    names = ''.join(f'<link name="l{i}"/>' for i in range(count))
    return f'<robot name="made">{names}{"".join(joints)}</robot>'


def joint(
    i: int,
    kind: str = 'revolute',
    xyz: str = '0 0 0',
    rpy: str = '0 0 0',
    axis: str = '0 0 1',
    more: str = '',
) -> str:
    """Return joint j<i>, from link l<i> to the next."""
    return (
        f'<joint name="j{i}" type="{kind}"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        f'<limit lower="-2" upper="2" effort="1" velocity="1"/>{more}</joint>'
    )
