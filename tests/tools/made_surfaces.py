"""Shared by the tests of surfaces in files."""
import subprocess
import tempfile
import unittest
from pathlib import Path


class MadeSurfaces(unittest.TestCase):
    """The results that the program `surface_results` writes, in `folder`."""

    program = None  # its path

    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.scratch.name)
        subprocess.run([cls.program, cls.folder], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()
