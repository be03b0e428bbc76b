"""The program: the command line and the window.

May import: all other packages.
"""
