"""The HTML templates beside this file."""

from functools import cache

import jinja2


@cache
def template(name: str) -> jinja2.Template:
    """A template by its file's name; what is filled in is escaped, and what is missing is an error."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("twin.views", ""),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)
