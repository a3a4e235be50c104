"""The site: `make docs` builds it into site/, from the pages of this folder, the docstrings and the examples."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src"), str(ROOT / "docs" / "_ext")]

from driftwise.version import __version__  # noqa: E402
from scripts import reference  # noqa: E402

project, author, copyright = "driftwise", "The driftwise developers", "the driftwise developers, MIT licence"
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "numpydoc",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "docstrings",
    "mathml",
    "names",
    "pages",
]
exclude_patterns = ["**/*.ipynb", "**/GALLERY_HEADER.rst", "**/sg_execution_times.rst"]
root_doc = "index"
nitpicky = False  # names in docstrings link where there is a page, and are code where there is none
suppress_warnings = ["myst.header", "config.cache"]

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
myst_links_external_new_tab = False

default_role = "py:obj"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

html_theme = "pydata_sphinx_theme"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_title = "driftwise"
html_favicon = "_static/mark.svg"
html_show_sourcelink = False
html_copy_source = False
html_show_search_summary = False  # it fetches pages, which browsers refuse a site without a server
html_math_renderer = "mathml"
html_theme_options = {
    "logo": {"text": "driftwise", "image_light": "_static/mark.svg", "image_dark": "_static/mark.svg"},
    "navbar_align": "left",
    "header_links_before_dropdown": 7,
    "navbar_end": ["theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "show_nav_level": 1,
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "tango",
    "pygments_dark_style": "monokai",
}
html_sidebars = {"index": [], "start": [], "which": [], "search": []}

sphinx_gallery_conf = {
    "examples_dirs": ["../examples/tutorials", "../examples/gallery"],
    "gallery_dirs": ["tutorials", "gallery"],
    "filename_pattern": r"[/\\]plot_",
    "ignore_pattern": r"(^|[/\\])(?!plot_)\w+\.py$",
    "subsection_order": [
        *(f"../examples/gallery/{name}" for name in ("jobs", "plants", "estimators", "memories", "detectors")),
        "*",
    ],
    "within_subsection_order": "FileNameSortKey",
    "nested_sections": False,
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "remove_config_comments": True,
    "abort_on_example_error": False,
    "only_warn_on_example_error": True,
    "write_computation_times": False,
    "capture_repr": ("_repr_html_", "__repr__"),
    "matplotlib_animations": False,
    "reset_modules": ("matplotlib",),
    "copyfile_regex": r".*\.(csv|toml)$",
}

reference.write(ROOT / "docs" / "reference")
