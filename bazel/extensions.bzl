"""@pbm_programs for MODULE.bazel; Bazel 4, which Debian 12 has, knows no extensions and reads WORKSPACE alone."""

load(":pbm.bzl", "pbm_programs")

def _programs(_ctx):
    pbm_programs(name = "pbm_programs")

programs = module_extension(implementation = _programs)
