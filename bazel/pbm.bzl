"""Models as targets of Bazel: pbm_asset builds a .pbvg from scans, pbm_programs finds the pbm-build that is installed."""

def _pbm_programs(ctx):
    program = ctx.attr.program or ctx.os.environ.get("PBM_BUILD") or "pbm-build"
    path = ctx.path(program) if program.startswith("/") else ctx.which(program)
    if not path or not path.exists:
        fail("%s is not there: install PBM, or name the program in PBM_BUILD" % program)
    ctx.symlink(path, "pbm-build")
    ctx.file("BUILD.bazel", 'exports_files(["pbm-build"], visibility = ["//visibility:public"])\n')

pbm_programs = repository_rule(
    implementation = _pbm_programs,
    doc = "The repository @pbm_programs: program, else $PBM_BUILD, else pbm-build of $PATH.",
    attrs = {"program": attr.string(doc = "Absolute path or name of pbm-build.")},
    environ = ["PATH", "PBM_BUILD"],
    local = True,
)

def _pbm_asset(ctx):
    out = ctx.outputs.out or ctx.actions.declare_file(ctx.label.name + ".pbvg")
    inputs = ctx.files.srcs + ctx.files.data
    args = ctx.actions.args()
    args.add("--warnings")
    if ctx.file.recipe:
        inputs = inputs + [ctx.file.recipe]
        args.add("--recipe", ctx.file.recipe)
    args.add_all([ctx.expand_location(option, ctx.attr.data) for option in ctx.attr.options])
    args.add("--output", out)
    args.add("--")
    args.add_all(ctx.files.srcs)
    ctx.actions.run(
        executable = ctx.executable._pbm_build,
        arguments = [args],
        inputs = inputs,
        outputs = [out],
        mnemonic = "PbmAsset",
        progress_message = "Building %s" % out.short_path,
    )
    return [DefaultInfo(files = depset([out]), runfiles = ctx.runfiles(files = [out]))]

pbm_asset = rule(
    implementation = _pbm_asset,
    doc = "Builds a .pbvg. What is dropped from a scan is printed; --strict or --deny in options makes it an error.",
    attrs = {
        "srcs": attr.label_list(allow_files = True, doc = "Scans; none where the recipe names them."),
        "recipe": attr.label(allow_single_file = [".toml"], doc = "Options of pbm-build as TOML."),
        "options": attr.string_list(doc = "Options of pbm-build; they win over the recipe. $(location FILE) of data."),
        "data": attr.label_list(
            allow_files = True,
            doc = "Files that scans, recipe or options name. In its sandbox pbm-build sees no others.",
        ),
        "out": attr.output(doc = "Default: NAME.pbvg."),
        "_pbm_build": attr.label(
            default = "@pbm_programs//:pbm-build",
            allow_single_file = True,
            executable = True,
            cfg = "exec",
        ),
    },
)
