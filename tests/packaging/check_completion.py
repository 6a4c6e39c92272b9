#!/usr/bin/env python3
"""Runs the completions that programs print in the shells they are for: check_completion.py PROGRAMS WORK_FOLDER"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

programs, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
failed = []
ran = 0

# Words of a command line, the last one to be completed -> proposals that must be among the answers, and others that
# must not. Every shell answers alike.
CASES = [
    ("pbm-render --thum", {"--thumbnail"}, {"--threads", "--output"}),
    ("pbm-render --quality f", {"fast", "fine"}, {"auto"}),
    ("pbm-render --quality=f", {"fast", "fine"}, {"auto"}),
    ("pbm-render -o pic", {"picture.png"}, {"scan.ply"}),
    ("pbm-render --output pic", {"picture.png"}, {"scan.ply"}),
    ("pbm-render --output=pic", {"picture.png"}, {"scan.ply"}),
    ("pbm-render pic", {"picture.png"}, {"scan.ply"}),
    ("pbm-render --json pic", {"picture.png"}, {"scan.ply"}),  # the model: --json takes a value after "=" only
    ("pbm-render --thumbnail pic", set(), {"picture.png"}),  # a number
    ("pbm-render --help cam", {"camera"}, {"look"}),
    ("pbm-build --colour 5", {"565"}, {"888"}),
    ("pbm-build --panorama d", {"default"}, {"picture.png"}),
    ("pbm-build a\\ b", {"a b.ply"}, {"scan.ply"}),
    ("pbm-validate --de", {"--deep"}, {"--json"}),
    ("pbm-validate --ignore metadata.r", {"metadata.run"}, {"picture.png"}),
    ("pbm-validate --explain 5.6.4", {"5.6.4"}, {"5.6.3"}),
    ("pbm-validate --explain=hash.c", {"hash.chunk"}, {"hash"}),
    ("pbm-build --deny missing", {"missing-image"}, {"dropped-attribute"}),
    ("pbm-build --allow=cache", {"cache-not-filled"}, {"missing-image"}),
]


def run(shell, script):
    result = subprocess.run([shell, *script], capture_output=True, text=True, cwd=work, timeout=60,
                            env={**os.environ, "HOME": str(work), "LC_ALL": "C.UTF-8"})
    return result.returncode, result.stdout, result.stderr


def bash(program, line, script):
    """What bash would offer: its splitting of words at '=' is repeated here."""
    words = re.findall(r"(?:\\.|[^\s=])+|=", line)
    code = f"""set -u
. {script}
compopt() {{ :; }}
COMP_WORDS=({' '.join(words)}) COMP_CWORD={len(words) - 1} COMPREPLY=()
function=$(complete -p {program} | sed 's/.*-F \\([^ ]*\\).*/\\1/')
$function {program} "${{COMP_WORDS[COMP_CWORD]}}" "${{COMP_WORDS[COMP_CWORD - 1]}}"
printf '%s\\n' ${{COMPREPLY[@]+"${{COMPREPLY[@]}}"}}"""
    return run("bash", ["-c", code])


def fish(program, line, script):
    code, out, errors = run("fish", ["--no-config", "-c", f"source {script}; complete -C '{line}'"])
    offers = [offer.split("\t")[0].replace("\\ ", " ") for offer in out.splitlines()]
    return code, "\n".join(re.sub(r"^--[\w-]+=(?=.)", "", offer) for offer in offers), errors


# zsh completes in an interactive shell only: one on a pseudo terminal prints what it would offer. Its arguments are the
# folders of the functions and of the files, then the lines. A line is typed once the editor waits for it (EDITORREADY):
# before, the terminal itself would take ^U, and erase the line.
ZSH = r"""
zmodload zsh/zpty
zpty shell zsh -f -i
zpty -w shell "PROMPT= ; fpath=($1 \$fpath); autoload -Uz compinit; compinit -u -D; cd $2; setopt no_list_beep"
zpty -w shell 'compadd() { if [[ ${@[1,(i)(-|--)]} == *-(O|A|D)* ]]; then builtin compadd "$@"; return $?; fi
  typeset -a offers; builtin compadd -A offers "$@"; builtin compadd "$@"; for o in $offers; do print -r -- "OFFER:$o"; done; }'
zpty -w shell 'zle-line-init() { print EDITOR""READY; }; zle -N zle-line-init'
zpty -w shell 'bindkey "^I" complete-word; print BEGIN""NOW'
zpty -r -m shell out '*BEGINNOW*EDITORREADY*'
for line in "${@[3,-1]}"; do
    zpty -w -n shell "$line"$'\t'
    zpty -w -n shell $'\x15print END""NOW\n'
    zpty -r -m shell out '*ENDNOW*EDITORREADY*'
    print -r -- "$out"
    print -r -- NEXTLINE
done
zpty -d shell
"""


def zsh_offers(folder):
    """What zsh offers for each line of CASES."""
    code, out, errors = run("zsh", ["-f", "-c", ZSH, "zsh", str(folder), str(work), *(line for line, _, _ in CASES)])
    if code or errors:
        failed.append(f"zsh: {code} {errors}")
    offers = out.split("NEXTLINE")
    return {case[0]: "\n".join(re.findall(r"OFFER:([^\r\n]*)", text)).replace("\\ ", " ")
            for case, text in zip(CASES, offers)}


def check(shell, complete, suffix):
    global ran
    if not shutil.which(shell):
        print(shell, "is not installed")
        return
    names = sorted(p.name for p in programs.glob("pbm-*") if p.is_file())
    for name in names:
        script = work / shell / (f"_{name}" if shell == "zsh" else name + suffix)
        script.parent.mkdir(exist_ok=True)
        script.write_text(subprocess.run([programs / name, f"--help={shell}"], capture_output=True, text=True,
                                         check=True).stdout)
        code, _, errors = run(shell, ["-n", str(script)])
        if code or errors:
            failed.append(f"{shell} -n {script.name}: {code} {errors}")
    if shell == "zsh":
        offers_of = zsh_offers(work / shell)
        complete = lambda _, line, __: (0, offers_of.get(line, ""), "")
    for line, wanted, unwanted in CASES:
        name = line.split()[0]
        script = work / shell / (f"_{name}" if shell == "zsh" else name + suffix)
        code, out, errors = complete(name, line, script)
        offers = {offer.rstrip(" =") for offer in out.splitlines()}
        ran += 1
        if errors or not wanted <= offers or unwanted & offers:
            failed.append(f"{shell}: {line}: offers {sorted(offers)}, not {sorted(wanted)} {errors}")


shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
for file in ("picture.png", "scan.ply", "a b.ply"):
    (work / file).touch()
check("bash", bash, ".bash")
check("fish", fish, ".fish")
check("zsh", None, "")
print("\n".join(failed + [f"{ran} command lines, {len(failed)} faults"]))
sys.exit(1 if failed or not ran else 0)
