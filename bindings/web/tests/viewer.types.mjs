// The TypeScript declarations fit pages, and declare what the element has.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { PROPERTIES } from "../viewer/properties.js";

const path = (name) => fileURLToPath(new URL(name, import.meta.url));

test("tsc accepts the declarations and a page that uses them", () => {
    const { stdout, status } = spawnSync(
        path("../node_modules/.bin/tsc"),
        ["--noEmit", "--strict", "--target", "es2022", "--module", "nodenext", path("usage.ts")],
        { encoding: "utf8" },
    );
    assert.equal(stdout, "");
    assert.equal(status, 0);
});
test("every public member is declared, and every declared member is there", () => {
    const members = (text) =>
        [...text.matchAll(/^ {4}(?:readonly |async |get )?([a-z]\w+)(?=\(|:)/gm)]
            .map((match) => match[1])
            .filter(
                (name) =>
                    !/^(constructor|connectedCallback|disconnectedCallback|attributeChangedCallback|addEventListener|removeEventListener)$/.test(
                        name,
                    ),
            );
    const code = readFileSync(path("../viewer/pbm-viewer.js"), "utf8");
    const types = readFileSync(path("../viewer/pbm-viewer.d.ts"), "utf8");
    const classOf = (text) => /class PbmViewer[^]*?\n}/.exec(text)[0];
    assert.deepEqual(
        new Set(members(classOf(types))),
        new Set([...members(classOf(code)), ...Object.keys(PROPERTIES)]),
    );
});
