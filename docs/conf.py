# SPDX-License-Identifier: Apache-2.0
"""Sphinx's settings; scripts/docs builds the pages without any network."""
import os

project = "Emberlock"
author = "Emberlock's maintainers"
copyright = author  # noqa: A001: Sphinx's name
extensions = ["myst_parser", "breathe"]
html_theme = "furo"
html_title = "Emberlock"
html_copy_source = False
html_show_sphinx = False
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
breathe_projects = {"Emberlock": os.path.join(os.environ["EMBERLOCK_DOCS"], "xml")}
breathe_default_project = "Emberlock"
breathe_default_members = ("members", "undoc-members")
primary_domain = "cpp"
highlight_language = "none"
