"""The commands of the command line: `raytracer NAME` is in NAME_cli.py."""
