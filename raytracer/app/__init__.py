"""The program: the command line and the window.

A command reads its arguments, checks them before slow imports, calls the packages below, and prints or writes their
results; no command measures or draws by itself. cli.py runs the commands, help_text.py has their help, options.py has
the arguments that several commands share, commands/NAME_cli.py is `raytracer NAME`, and viewer/ is the window of
`raytracer view`. The package may import all other packages; no other package imports it. `raytracer/__main__.py` uses:

    cli: main
"""
