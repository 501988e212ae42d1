"""Settings of Sphinx, for `make docs` and rosdoc2."""

from pathlib import Path
import sys

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

project = 'icub_leg_fk'
author = project_copyright = 'icub_leg_fk maintainers'
version = release = '0.1.0'
extensions = ['myst_parser', 'sphinx.ext.autodoc', 'sphinx.ext.napoleon']
myst_heading_anchors = 3
autodoc_member_order = 'bysource'
autodoc_typehints = 'description'
autodoc_typehints_description_target = 'documented'
exclude_patterns = ['_build']
html_theme = 'alabaster'
html_theme_options = {
    'description': 'Joint angles in, foot poses out',
    'page_width': '1240px',
    'body_max_width': 'none',
    'code_font_size': '0.75em',
}
