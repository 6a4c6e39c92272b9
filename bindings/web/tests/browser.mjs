// What tests in Chromium share: a browser, a server, and pages that are written for one test.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";
import { startServer } from "./server.mjs";

export const root = resolve(dirname(fileURLToPath(import.meta.url)), "../../..");
export const golden = join(root, "format_spec/golden");
// The flat folder that scripts/make_web_package.sh fills.
export const package_ = resolve(process.env.PBM_WEB_PACKAGE ?? join(root, "build/web/package"));
// Programs of the native build, which say what is right.
export const programs = resolve(process.env.PBM_PROGRAMS ?? join(root, "build/release/bin"));

// `models`: folders that the server shows beside the package. The result has browser, server, scratch and
//   open(body, options)  a page with this content, whose viewer is called `viewer`. Options besides those of a page of
//                        playwright: more of the head; whether to wait until the viewer rests; a file of the package
//                        that is not there; and from where the viewer comes
export async function start({ models = [], ...options } = {}) {
    const scratch = mkdtempSync(join(tmpdir(), "pbm-browser-"));
    const versions = ["1.0", "1.1", "1.2"].map((version) => join(golden, version));
    const server = await startServer([scratch, package_, ...versions, ...models], options);
    const browser = await chromium.launch({
        executablePath: process.env.PBM_CHROMIUM ?? "/usr/bin/chromium",
        args: ["--no-sandbox"],
    });
    let pages = 0;
    async function open(body, { head = "", wait = true, missing = null, from = "", ...context } = {}) {
        const page = await browser.newPage({ viewport: { width: 640, height: 480 }, ...context });
        page.faults = [];
        page.on("pageerror", (error) => page.faults.push(String(error)));
        page.on("console", (message) => message.type() === "error" && page.faults.push(message.text()));
        await page.route("**/favicon.ico", (route) => route.fulfill({ status: 204 }));
        if (missing) await page.context().route(`**/${missing}`, (route) => route.fulfill({ status: 404 }));
        const name = `page${++pages}.html`;
        writeFileSync(
            join(scratch, name),
            `<!doctype html><html lang="en"><meta charset="utf-8">${head}
            <style nonce="page">body { margin: 0 } pbm-viewer { width: 320px; height: 240px }</style>
            <script nonce="page">window.heard = []; for (const name of ["load", "progress", "error", "camera-change"])
                document.addEventListener(name, ({ target, detail }) =>
                    detail && heard.push({ event: name, id: target.id, ...detail }), true);
            </script>
            <script type="module" src="${from}pbm-viewer.js"></script>${body}`,
        );
        await page.goto(`${server.url}/${name}`);
        if (wait) await atRest(page);
        return page;
    }
    return {
        browser,
        server,
        scratch,
        open,
        async close() {
            await browser.close();
            server.close();
            rmSync(scratch, { recursive: true });
        },
    };
}

// Until the view rests, and its picture is the last one.
export async function atRest(page, id = "viewer") {
    const rests = await page.evaluate(async (id) => {
        await customElements.whenDefined("pbm-viewer");
        const viewer = document.getElementById(id);
        // Twice in a row: a change may not have reached the worker yet.
        let times = 0;
        for (let i = 0; times < 2 && i < 800; ++i) {
            await new Promise((resolve) => setTimeout(resolve, 60));
            times = viewer.loaded && (await viewer.statistics())?.resting ? times + 1 : 0;
        }
        return times === 2;
    }, id);
    assert.ok(rests, `the view does not come to rest: ${JSON.stringify(await page.evaluate(() => heard.slice(-5)))}`);
}

// A picture as {width, height, pixels: straight RGBA bytes}: of the viewer with this id, or of an image file's bytes.
export async function pictureOf(page, source = "viewer") {
    const { width, height, text } = await page.evaluate(
        async ({ id, image }) => {
            const blob = image
                ? await (await fetch(`data:;base64,${image}`)).blob()
                : await document.getElementById(id).toBlob();
            const bitmap = await createImageBitmap(blob, { premultiplyAlpha: "none", colorSpaceConversion: "none" });
            const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d", {
                willReadFrequently: true,
            });
            context.drawImage(bitmap, 0, 0);
            const { data, width, height } = context.getImageData(0, 0, bitmap.width, bitmap.height);
            let text = "";
            for (let i = 0; i < data.length; i += 8192) text += String.fromCharCode(...data.subarray(i, i + 8192));
            return { width, height, text: btoa(text) };
        },
        typeof source === "string" ? { id: source } : { image: source.toString("base64") },
    );
    return { width, height, pixels: Buffer.from(text, "base64") };
}

export function sameBytes(actual, expected) {
    assert.deepEqual([actual.width, actual.height], [expected.width, expected.height]);
    const { pixels } = actual;
    const differing = pixels.reduce((sum, byte, i) => sum + (byte !== expected.pixels[i]), 0);
    assert.equal(differing, 0, `${differing} of ${pixels.length} bytes differ`);
    assert.ok(
        pixels.some((byte) => byte !== pixels[0] && byte !== 255),
        "the picture is empty",
    );
}
