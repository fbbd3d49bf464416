"""Arms that others described, in packages that anybody can install: what docs/imported-robots.md is made of."""
