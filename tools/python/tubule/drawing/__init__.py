"""Pictures of results, for the program (`tubule plot` and others) and for the functions of the package tubule.

Nothing here needs the compiled part of the package: see __main__.py.
"""
