// The npm package in the hands of bundlers: pages that they build show the picture, on a server that has nothing but what
// they wrote. Declarations and exports of the package satisfy those who judge packages.
//
//   PBM_WEB_ARCHIVE  the package, as npm packs it; default: that of build/web
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { cpSync, existsSync, mkdirSync, mkdtempSync, readdirSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { fileURLToPath } from "node:url";
import { atRest, golden, pictureOf, root, sameBytes, start } from "./browser.mjs";
import { startServer } from "./server.mjs";

const bundlers = fileURLToPath(new URL("bundlers/", import.meta.url));
const build = join(root, "build/web");
const archive = process.env.PBM_WEB_ARCHIVE ?? join(build, readdirSync(build).find((name) => /^pbm-viewer-.*\.tgz$/.test(name)));
const skip = existsSync(join(bundlers, "node_modules")) ? false : "npm packages are not installed: scripts/test_web.sh";
const HTML = (script) => `<!doctype html><html lang="en"><meta charset="utf-8"><title>Page</title>
<style>pbm-viewer { width: 320px; height: 240px } body { margin: 0 }</style><div id="root"></div>
<script type="module" src="${script}"></script></html>`;

let tests;
let project; // a folder with the bundlers' packages and ours
let expected;
before(async () => {
    if (skip) return;
    tests = await start();
    const page = await tests.open(`<pbm-viewer id="viewer" src="scan-everything.pbvg" quality="fast" background="#333">`);
    expected = await pictureOf(page);
    await page.close();
    project = mkdtempSync(join(tmpdir(), "pbm-bundlers-"));
    cpSync(bundlers, project, { recursive: true, filter: (name) => !name.includes("node_modules") });
    mkdirSync(join(project, "node_modules"));
    for (const name of readdirSync(join(bundlers, "node_modules")))
        symlinkSync(join(bundlers, "node_modules", name), join(project, "node_modules", name));
    execFileSync("tar", ["-xzf", archive, "-C", project]);
    cpSync(join(project, "package"), join(project, "node_modules/pbm-viewer"), { recursive: true });
});
after(async () => {
    if (skip) return;
    await tests.close();
    rmSync(project, { recursive: true });
});

function run(program, ...given) {
    const { status, stdout, stderr } = spawnSync(join(bundlers, "node_modules/.bin", program), given, {
        cwd: project,
        encoding: "utf8",
        env: { ...process.env, NODE_ENV: "production" },
    });
    assert.equal(status, 0, `${program}: ${stdout}${stderr}`);
    return stdout + stderr;
}

// Copies what a bundler does not: see the how-to page.
function copyBeside(folder) {
    for (const name of ["view_worker.js", "pbm.wasm", "pbm_threads.js", "pbm_threads.wasm", "pbm_threads.worker.js"])
        cpSync(join(project, "package", name), join(project, folder, name));
}

async function assertShown(folder, options = {}) {
    cpSync(join(golden, "1.0/scan-everything.pbvg"), join(project, folder, "model.pbvg"));
    const server = await startServer([join(project, folder)], options);
    const page = await tests.browser.newPage({ viewport: { width: 640, height: 480 } });
    try {
        page.faults = [];
        page.on("pageerror", (error) => page.faults.push(String(error)));
        await page.addInitScript(() => {
            window.heard = [];
        });
        await page.goto(`${server.url}/index.html`);
        await page.waitForFunction(() => document.getElementById("viewer"));
        await atRest(page);
        sameBytes(await pictureOf(page), expected);
        assert.equal(await page.evaluate(() => document.body.dataset.heard), "load");
        assert.deepEqual(page.faults, []);
        return await page.evaluate(() => viewer.statistics());
    } finally {
        await page.close();
        server.close();
    }
}

function vite(name, script, plugin) {
    writeFileSync(join(project, "index.html"), HTML(script));
    writeFileSync(
        join(project, `${name}.config.js`),
        `import plugin from "${plugin}";
        export default { plugins: [plugin(${name === "vue" ? '{ template: { compilerOptions: { isCustomElement: (tag) => tag === "pbm-viewer" } } }' : ""})],
            base: "./", build: { outDir: "${name}", target: "es2022" } };`,
    );
    run("vite", "build", "--config", `${name}.config.js`, "--logLevel", "warn");
}

describe("bundlers", { skip }, () => {
    test("Vite, with React", async () => {
        vite("react", "/page.jsx", "@vitejs/plugin-react");
        await assertShown("react");
    });
    test("Vite, with Vue, also on a page that is isolated", async () => {
        vite("vue", "/page_vue.js", "@vitejs/plugin-vue");
        await assertShown("vue");
        await assertShown("vue", { isolated: true });
    });
    test("webpack 5, also with threads", async () => {
        const config = `export default { mode: "production", entry: "./page_plain.js", output: { path: "${join(project, "webpack")}" } };`;
        writeFileSync(join(project, "webpack.config.js"), config);
        run("webpack", "--config", "webpack.config.js");
        writeFileSync(join(project, "webpack/index.html"), HTML("main.js"));
        await assertShown("webpack");
        assert.ok((await assertShown("webpack", { isolated: true })).threads > 1);
    });
    test("esbuild, with the files copied beside", async () => {
        run("esbuild", "page_plain.js", "--bundle", "--minify", "--format=esm", "--outfile=esbuild/main.js");
        copyBeside("esbuild");
        writeFileSync(join(project, "esbuild/index.html"), HTML("main.js"));
        await assertShown("esbuild");
    });
    test("rollup, with the files copied beside", async () => {
        run("rollup", "page_plain.js", "--plugin", "node-resolve", "--format", "es", "--file", "rollup/main.js");
        copyBeside("rollup");
        writeFileSync(join(project, "rollup/index.html"), HTML("main.js"));
        await assertShown("rollup");
    });
});

describe("the package", { skip }, () => {
    test("publint finds nothing", () => {
        assert.match(run("publint", join(project, "package"), "--strict"), /All good/);
    });
    test("are the types wrong? No", () => {
        run("attw", archive, "--profile", "esm-only");
    });
    test("JSX of React 19 knows the element", () => {
        const options = ["--noEmit", "--strict", "--target", "es2022", "--module", "nodenext", "--jsx", "react-jsx"];
        run("tsc", ...options, "usage.tsx");
    });
    test("imports in Node do nothing without a window, and the library finds its files there", () => {
        const code = `const before = Object.keys(globalThis).length;
            const { PbmViewer } = await import("pbm-viewer");
            const { loadPbm, loadValidator } = await import("pbm-viewer/pbm.js");
            console.log(typeof PbmViewer, Object.keys(globalThis).length - before);
            console.log((await loadPbm({ threads: 0 })).version === (await loadValidator()).version);`;
        const printed = execFileSync(process.execPath, ["--input-type=module", "--eval", code], { cwd: project, encoding: "utf8" });
        assert.equal(printed, "function 0\ntrue\n");
    });
});
