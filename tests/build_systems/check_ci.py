#!/usr/bin/env python3
"""The hook for pre-commit and the action for GitHub's workflows, run as their users run them: check_ci.py hook|action ROOT
PROGRAMS WORK"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

part = sys.argv[1]
root, programs, work = (pathlib.Path(word).resolve() for word in sys.argv[2:])
work = work / part
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}", "HOME": str(work / "home"),
               "PRE_COMMIT_HOME": str(work / "pre-commit"), "GIT_CONFIG_NOSYSTEM": "1"}
for who in ("AUTHOR", "COMMITTER"):
    environment |= {f"GIT_{who}_NAME": "test", f"GIT_{who}_EMAIL": "test@example.org"}
valid, invalid = root / "format_spec/vectors/valid/smallest.pbvg", root / "format_spec/vectors/invalid/4.2-zero-mask.pbvg"
faults = []


def expect(condition, what):
    if not condition:
        faults.append(str(what))


def skip(what):
    print(f"skipped: {what}")
    sys.exit(77)


def run(*words, folder, exit_code=0, **more):
    done = subprocess.run([str(word) for word in words], cwd=folder, env={**environment, **more}, capture_output=True,
                          text=True)
    expect(done.returncode == exit_code, f"{words}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def check_hook():
    if not shutil.which("pre-commit") or not shutil.which("git"):
        skip("pre-commit or git is not installed")
    sources, project = work / "pbm", work / "project"  # a clone of ours, and the repository of a user
    for folder in (work / "home", sources, project):
        folder.mkdir()
    shutil.copy(root / ".pre-commit-hooks.yaml", sources)
    for folder in (sources, project):
        run("git", "init", "-q", folder=folder)
    run("git", "add", ".", folder=sources)
    run("git", "commit", "-q", "-m", "hooks", folder=sources)
    run("git", "tag", "v1.0.0", folder=sources)
    page = (root / "docs/how-to/validate-in-a-pipeline.md").read_text()
    config = re.search(r"```yaml\n(repos:.*?)```", page, re.DOTALL)[1]
    expect("/path/to/pbm" in config, config)
    (project / ".pre-commit-config.yaml").write_text(config.replace("/path/to/pbm", str(sources)))
    run("pre-commit", "install", folder=project)
    shutil.copy(valid, project / "good model.pbvg")
    (project / "notes.txt").write_text("no model\n")
    run("git", "add", ".", folder=project)
    expect("Passed" in run("git", "commit", "-m", "a model", folder=project), "a valid model does not pass")
    shutil.copy(invalid, project / "bad.pbvg")
    run("git", "add", ".", folder=project)
    said = run("git", "commit", "-m", "a bad model", folder=project, exit_code=1)
    expect("INVALID bad.pbvg" in said and "4.2" in said and "good" not in said, said)
    run("git", "rm", "-q", "--cached", "bad.pbvg", folder=project)
    (project / "bad.pbvg").rename(project / "--log=z.pbvg")
    run("git", "add", ".", folder=project)
    said = run("git", "commit", "-m", "a name like an option", folder=project, exit_code=1)
    expect("INVALID --log=z.pbvg" in said, said)
    run("git", "rm", "-q", "--cached", "--", "--log=z.pbvg", folder=project)
    (project / "more.txt").write_text("no model\n")
    run("git", "add", "more.txt", folder=project)
    expect("Skipped" in run("git", "commit", "-m", "no model", folder=project), "the hook runs without a model")


def check_action():
    try:
        import yaml
    except ModuleNotFoundError:
        skip("the Python package yaml is missing (python3-yaml)")
    action = yaml.safe_load((root / "action.yml").read_text())
    step, = action["runs"]["steps"]
    expect(action["runs"]["using"] == "composite" and step["shell"] == "bash" and step["id"] == "validate", step)
    used = set(re.findall(r"inputs\.([\w-]+)", str(step)))
    expect(used == set(action["inputs"]), f"inputs are {set(action['inputs'])}, used are {used}")
    expect("${{" not in step["run"], "an input becomes a part of the script")
    written = set(re.findall(r"steps\.validate\.outputs\.([\w-]+)", str(action["outputs"])))

    def take(exit_code, **inputs):
        """Runs the step as a workflow does. Returns its output and the outputs of the action."""
        folder = work / "checkout"
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "models").mkdir(parents=True)
        shutil.copy(valid, folder / "models/good model.pbvg")
        shutil.copy(invalid, folder / "bad.pbvg")
        (folder / "old.sarif").write_text("of an earlier step")
        values = {name: value.get("default", "") for name, value in action["inputs"].items()} | inputs
        variables = {name: re.sub(r"\$\{\{ inputs\.([\w-]+) \}\}", lambda match: values[match[1]], text)
                     for name, text in step["env"].items()}
        script, outputs = work / "step.sh", work / "outputs"
        script.write_text(step["run"])
        outputs.write_text("")
        said = run("bash", "--noprofile", "--norc", "-eo", "pipefail", script, folder=folder, exit_code=exit_code,
                   GITHUB_OUTPUT=str(outputs), **variables)
        found = dict(line.split("=", 1) for line in outputs.read_text().splitlines())
        expect(set(found) <= written, found)
        expect("sarif" not in found or (folder / found["sarif"]).read_text().startswith("{"), found)
        return said, found, folder

    said, found, _ = take(0, files="models\n")
    expect("VALID models/good model.pbvg" in said and found == {"sarif": "pbm-validate.sarif", "exit-code": "0"}, found)
    said, found, folder = take(3, files="models\n\nbad.pbvg\n", sarif="a b.sarif", junit="verdicts.xml", level="deep")
    expect("INVALID bad.pbvg" in said and found == {"sarif": "a b.sarif", "exit-code": "3"}, found)
    expect((folder / "verdicts.xml").exists(), "no JUnit")
    said, found, folder = take(3, files="  models \r\n\tbad.pbvg\r\n \r\n", sarif="")
    expect("VALID models/good model.pbvg" in said and "INVALID bad.pbvg" in said, said)
    expect(found == {"exit-code": "3"} and not list(folder.glob("*.sarif"))[1:], f"{found} {list(folder.iterdir())}")
    _, found, folder = take(1, files="models", level="help", sarif="old.sarif")
    expect(not found, found)
    _, found, folder = take(1, files="", sarif="old.sarif")
    expect(found == {"exit-code": "1"}, found)
    _, found, _ = take(127, files="models", program="./none")
    expect(found == {"exit-code": "127"}, found)
    _, found, folder = take(2, files='$(touch stolen)\n"; touch stolen; "\n-r')
    expect(not (folder / "stolen").exists() and found["exit-code"] == "2", found)


{"hook": check_hook, "action": check_action}[part]()
print("\n".join(faults + [f"{part}: {len(faults)} faults"]))
sys.exit(1 if faults else 0)
