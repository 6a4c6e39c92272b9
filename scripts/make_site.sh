#!/usr/bin/env bash
# Makes the documentation site and checks its links: make_site.sh OUT
# OUT/index.html is its first page; it needs no server. Exits with 77 where packages are missing.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
/usr/bin/python3 -c 'import mkdocs.theme, PIL, pymdownx; mkdocs.theme.Theme("material")' 2>/dev/null || {
    echo "site: packages are missing: run scripts/install_packages.sh site" >&2
    exit 77
}
exec /usr/bin/python3 -B "$here/../docs/site/make_site.py" "$@"
