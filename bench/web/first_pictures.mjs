// Bytes and times to the first picture, to 99 % of the final one, and to the final one, over a slow line in Chromium:
//   first_pictures.mjs PACKAGE MODEL.pbvg [FOLDER_OF_GLB]
// PACKAGE: build/web/package. FOLDER_OF_GLB: what make_glb.mjs wrote of the same scan; <model-viewer> shows them.
// Medians of RUNS, each in a new browser; contestants by turns. Times count from the navigation, milliseconds.
//
//   load    the element's event of that name, in a visit of its own: to look at pictures slows the browser down
//   first   more than 2 % of the pixels have another colour than the lower left corner
//   99 %    of the pixels stay within 8 of 255 of the final picture from then on
//   final   the last change
import { mkdtempSync, rmSync, writeFileSync, existsSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, dirname, join, resolve } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";
import { chromium } from "playwright-core";
import sharp from "sharp";
import { startSlowServer } from "./slow_server.mjs";

const RUNS = +(process.env.RUNS ?? 5);
const LINE = { rate: 10e6 / 8, delay: 40 };
const SIZE = { width: 1280, height: 720 };
const BACKGROUND = "#333333";
const QUIET = 5000; // ms without a change: the picture is final
const LONGEST = 120_000;

const [packageFolder, model, glbFolder] = process.argv.slice(2);
const peers = join(import.meta.dirname, "node_modules/@google/model-viewer/dist");
const style = `<style>html, body { margin: 0; height: 100%; background: ${BACKGROUND} }
    pbm-viewer, model-viewer { display: block; width: 100%; height: 100%; background: ${BACKGROUND} }</style>`;
const contestants = [{ name: "pbm-viewer", model: basename(model), page: `<script type="module" src="pbm-viewer.js"></script>
    ${style}<pbm-viewer src="${basename(model)}" background="${BACKGROUND}" quality="fast"></pbm-viewer>` }];
for (const kind of ["draco", "meshopt"])
    if (glbFolder && existsSync(join(glbFolder, `${kind}.glb`)))
        contestants.push({ name: `model-viewer, ${kind}`, model: `${kind}.glb`,
            page: `<script>self.ModelViewerElement = { meshoptDecoderLocation: "/meshopt_decoder.js", dracoDecoderLocation: "/" }</script>
                <script type="module" src="model-viewer.min.js"></script>${style}<model-viewer src="${kind}.glb" interaction-prompt="none"></model-viewer>` });

async function pixelsOf(frame) {
    return (await sharp(Buffer.from(frame.data, "base64")).resize(SIZE.width / 2, SIZE.height / 2, { kernel: "nearest" })
        .removeAlpha().raw().toBuffer());
}

// Share of the pixels that differ from the one in the lower left corner.
function shown(pixels) {
    const corner = 3 * (SIZE.width / 2) * (SIZE.height / 2 - 1);
    let differing = 0;
    for (let i = 0; i < pixels.length; i += 3)
        differing += [0, 1, 2].some((channel) => Math.abs(pixels[i + channel] - pixels[corner + channel]) > 8);
    return differing / (pixels.length / 3);
}

// Share of the pixels that are within 8 of 255 in each channel.
function likeness(a, b) {
    let like = 0;
    for (let i = 0; i < a.length; i += 3)
        like += Math.abs(a[i] - b[i]) <= 8 && Math.abs(a[i + 1] - b[i + 1]) <= 8 && Math.abs(a[i + 2] - b[i + 2]) <= 8;
    return like / (a.length / 3);
}

// Calls work(page, server) with an empty page and a server of the contestant's files.
async function visit({ page: content }, work) {
    const scratch = mkdtempSync(join(tmpdir(), "pbm-bench-"));
    writeFileSync(join(scratch, "index.html"), `<!doctype html><html lang="en"><meta charset="utf-8">${content}`);
    const folders = [scratch, packageFolder, dirname(resolve(model)), peers,
        join(import.meta.dirname, "node_modules/meshoptimizer"),
        join(import.meta.dirname, "node_modules/three/examples/jsm/libs/draco/gltf")];
    const server = await startSlowServer(glbFolder ? [...folders, glbFolder] : folders, LINE);
    const browser = await chromium.launch({
        executablePath: process.env.PBM_CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox",
            "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] }); // WebGL without a GPU, for the peers
    try {
        const page = await browser.newPage({ viewport: SIZE });
        await page.goto("about:blank");
        return await work(page, server);
    } finally {
        await browser.close();
        server.close();
        rmSync(scratch, { recursive: true });
    }
}

// The event `load`, milliseconds after the navigation and after the code and 64 KB of the model are there.
async function awaitLoad({ model: file }, page, server) {
    await page.addInitScript(() => addEventListener("DOMContentLoaded", () =>
        document.querySelector("pbm-viewer, model-viewer").addEventListener("load", () => {
            window.loadedAt ??= performance.timeOrigin + performance.now();
        })));
    const start = performance.now();
    await page.goto(`${server.url}/index.html`, { waitUntil: "commit" });
    await page.waitForFunction(() => window.loadedAt, null, { polling: 20, timeout: LONGEST });
    const load = await page.evaluate(() => window.loadedAt) - performance.timeOrigin;
    const code = server.log.filter(({ path }) => path.endsWith(".wasm") || path.endsWith(".js"));
    let bytes = 0;
    const kilobyte64 = server.log.filter(({ path }) => path === `/${file}`).flatMap((entry) => entry.bytes)
        .find(([, size]) => (bytes += size) >= 65536)?.[0] ?? 0;
    return { ms: load - start, later: load - Math.max(kilobyte64, ...code.map(({ end }) => end)) };
}

async function watch({ name, model: file }, page, server) {
    const session = await page.context().newCDPSession(page);
    const frames = [];
    let looking = true;
    const look = async () => { // as often as the browser can: a picture costs some 50 ms
        while (looking) {
            const time = performance.now();
            const { data } = await session.send("Page.captureScreenshot", { format: "png", optimizeForSpeed: true })
                .catch(() => ({})); // between two pages there is nothing to see
            if (data && data !== frames.at(-1)?.data) frames.push({ time, data });
        }
    };
    const start = performance.now();
    await page.goto(`${server.url}/index.html`, { waitUntil: "commit" });
    const watching = look();
    const isModel = (path) => path === `/${file}`;
    while (performance.now() - start < LONGEST) {
        await sleep(200);
        const last = Math.max(frames.at(-1)?.time ?? start, ...server.log.flatMap(({ bytes }) => bytes.at(-1)?.[0] ?? start));
        const loaded = await page.evaluate(() => document.querySelector("pbm-viewer, model-viewer")?.loaded);
        if (loaded && performance.now() - last > QUIET) break;
    }
    looking = false;
    await watching;
    const pixels = await Promise.all(frames.map(pixelsOf));
    const final = pixels.at(-1);
    const shows = pixels.findIndex((frame) => shown(frame) > 0.02);
    if (shows < 0) throw new Error(`${name} shows nothing`);
    const near = frames.findLastIndex((_, i) => likeness(pixels[i], final) < 0.99) + 1;
    const same = frames.findLastIndex((_, i) => !pixels[i].equals(final)) + 1;
    const at = (i) => ({ ms: frames[i].time - start, model: server.sent(isModel, frames[i].time),
        code: server.sent((path) => !isModel(path), frames[i].time) });
    if (process.env.PICTURES) writeFileSync(join(process.env.PICTURES, `${name.replace(/\W+/g, "-")}.png`), Buffer.from(frames.at(-1).data, "base64"));
    return { first: at(shows), near: at(near), final: at(same), requests: server.log.filter(({ path }) => isModel(path)).length };
}

const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];
const results = contestants.map(() => []);
for (let i = 0; i < RUNS; ++i)
    for (const [c, contestant] of contestants.entries())
        results[c].push({ load: await visit(contestant, (...to) => awaitLoad(contestant, ...to)),
            ...await visit(contestant, (...to) => watch(contestant, ...to)) });
console.log("| | load, ms | first, ms | bytes of the model | 99 %, ms | bytes | final, ms | bytes | requests | code, KB |");
console.log("|---|---|---|---|---|---|---|---|---|---|");
for (const [c, { name }] of contestants.entries()) {
    const of = (pick) => Math.round(median(results[c].map(pick)));
    console.log(`| ${name} | ${of((r) => r.load.ms)} | ${of((r) => r.first.ms)} | ${of((r) => r.first.model)} | ${of((r) => r.near.ms)} | ${of((r) => r.near.model)} | `
        + `${of((r) => r.final.ms)} | ${of((r) => r.final.model)} | ${of((r) => r.requests)} | ${of((r) => r.final.code) / 1000} |`);
}
console.log(`pbm-viewer: load ${Math.round(median(results[0].map((r) => r.load.later)))} ms after its code and 64 KB of the model`);
