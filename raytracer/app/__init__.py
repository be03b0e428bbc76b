"""The program: the command line and the window.

Commands read arguments, check them before slow imports, call the packages below, and print or write values; no command
measures or draws by itself. cli.py lists the commands, options.py has the arguments that several share,
commands/NAME_cli.py is `raytracer NAME`, viewer/ the window of `raytracer view`. The package may import all others; no
other package imports it. `raytracer/__main__.py` uses:

    cli: main
"""
