"""Whether evolved programs drive in other engines as gecar promises; ``README.md`` says how."""
