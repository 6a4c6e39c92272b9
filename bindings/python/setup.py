"""What pyproject.toml cannot say: the version of the library, and the machines that it runs on."""

import os

from setuptools import setup
from wheel.bdist_wheel import bdist_wheel


class PlatformWheel(bdist_wheel):
    """The library is of one kind of machine, and of any Python."""

    def finalize_options(self):
        super().finalize_options()
        self.root_is_pure = False

    def get_tag(self):
        return "py3", "none", os.environ["PBM_WHEEL_PLATFORM"]


setup(version=os.environ["PBM_WHEEL_VERSION"], cmdclass={"bdist_wheel": PlatformWheel})
