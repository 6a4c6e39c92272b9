// The viewer as a part of a page: on paper and on phones that are turned, under policies, with keys and in German, and what
// it says where it can show nothing.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { atRest, golden, package_, pictureOf, programs, sameBytes, start } from "./browser.mjs";

const MODEL = "scan-everything.pbvg";
const VIEWER = `<pbm-viewer id="viewer" src="${MODEL}" controls alt="A sample" background="#333" quality="fast">`;
let tests;
before(async () => {
    tests = await start();
});
after(() => tests.close());

async function withPage(body, options, check) {
    const page = await tests.open(body, options);
    try {
        await check(page);
    } finally {
        await page.close();
    }
}
// A statue in the folder of the server. Returns its file.
function buildStatue(name, points, depth, ...more) {
    const model = join(tests.scratch, name);
    execFileSync(join(programs, "pbm-sample"), ["--shape", "statue", "--points", points, "--normals", "-o", `${model}.ply`, "-q"]);
    execFileSync(join(programs, "pbm-build"), [`${model}.ply`, "-o", model, "--depth", depth, "-q", ...more]);
    return model;
}
const errors = (page) => page.evaluate(() => heard.filter(({ event }) => event === "error"));
const notice = (page) => page.locator("#message").innerText();
const orbit = (page) => page.evaluate(() => ({ ...viewer.getCameraOrbit(), toString: undefined }));
const awaitError = (page, timeout = 30000) =>
    page.waitForFunction(() => heard.some(({ event }) => event === "error"), null, { timeout });

describe("pictures of another shape", () => {
    test("a canvas whose shape changed shows the whole last picture, not stretched, until there is the next one", () =>
        withPage(VIEWER, {}, async (page) => {
            await page.evaluate(() => {
                // The worker hears of nothing any more.
                Object.defineProperty(document, "hidden", { value: true, configurable: true });
                document.dispatchEvent(new Event("visibilitychange"));
                viewer.style.cssText = "width: 320px; height: 480px !important";
            });
            await page.waitForTimeout(200);
            const canvas = page.locator("canvas[part]");
            assert.equal(await canvas.evaluate((element) => getComputedStyle(element).objectFit), "contain");
            const { pixels } = await pictureOf(page, await page.screenshot({ clip: { x: 0, y: 0, width: 320, height: 480 } }));
            // Above the picture, which keeps its shape, nothing is drawn.
            assert.deepEqual([...pixels.subarray(4 * (320 * 60 + 100), 4 * (320 * 60 + 100) + 3)], [255, 255, 255]);
        }));
    // Sizes of the images in a PDF.
    const imagesOf = (pdf) =>
        [...pdf.toString("latin1").matchAll(/\/Subtype \/Image\n\/Width (\d+)\n\/Height (\d+)/g)].map((match) => +match[1]);
    test("paper gets a picture of its resolution, and no buttons", () =>
        withPage(VIEWER, {}, async (page) => {
            const before = await page.evaluate(() => viewer.statistics());
            await page.waitForFunction(() => viewer.shadowRoot.getElementById("paper").classList.contains("ready"), null, { timeout: 20000 });
            const [width, height] = await page.evaluate(() => {
                const canvas = viewer.shadowRoot.getElementById("paper");
                return [canvas.width, canvas.height];
            });
            assert.deepEqual([width, height], [1000, 750]); // 300 pixels an inch
            assert.ok(imagesOf(await page.pdf()).includes(1000), "the paper shows another picture");
            await page.emulateMedia({ media: "print" });
            for (const id of ["fullscreen", "bar", "notice"]) assert.equal(await page.locator(`#${id}`).isVisible(), false, id);
            assert.equal(await page.locator("#paper").isVisible(), true);
            await page.emulateMedia({ media: "screen" });
            // It cost no byte, and the view goes on as before.
            const after = await page.evaluate(() => viewer.statistics());
            assert.equal(after.bytes, before.bytes);
            await page.evaluate(() => viewer.setCamera({ orbit: "40deg 75deg 100%" }, { smooth: false }));
            await page.waitForFunction(() => !viewer.shadowRoot.getElementById("paper").classList.contains("ready"));
            await atRest(page);
        }));
    test("points under the mouse are right after a picture for paper", () =>
        withPage(VIEWER, {}, async (page) => {
            const point = () => page.evaluate(async () => String(await viewer.positionFromPoint(150, 110)));
            const before = await point();
            await page.waitForFunction(() => viewer.shadowRoot.getElementById("paper").classList.contains("ready"), null, { timeout: 20000 });
            assert.notEqual(before, "null");
            assert.equal(await point(), before);
        }));
    test("a viewer that was never near the screen has its poster on paper", () =>
        withPage(
            `<div style="height: 5000px"></div>${VIEWER}<img slot="poster" src="poster.svg" width="9"></pbm-viewer>`,
            { wait: false },
            async (page) => {
                writeFileSync(join(tests.scratch, "poster.svg"), "<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'/>");
                await page.waitForFunction(() => customElements.get("pbm-viewer"));
                await page.emulateMedia({ media: "print" });
                assert.equal(await page.evaluate(() => viewer.loaded), false);
                assert.equal(await page.locator("img[slot=poster]").isVisible(), true);
            },
        ));
});

describe("quality", () => {
    test("auto settles by drawing alone: what decoding takes does not count", async () => {
        buildStatue("fine.pbvg", 300000, 9);
        // On the worker's clock, each range that is decoded takes a second.
        const slow = `const now = performance.now.bind(performance), set = Uint8Array.prototype.set;
            let decoded = 0;
            performance.now = () => now() + 1000 * decoded;
            Uint8Array.prototype.set = function (...given) {
                if (this.buffer.byteLength > 2 ** 20) ++decoded;
                return set.apply(this, given);
            };\n`;
        const page = await tests.browser.newPage({ viewport: { width: 640, height: 480 } });
        await page.route("**/view_worker.js", (route) =>
            route.fulfill({ contentType: "text/javascript", body: slow + readFileSync(join(package_, "view_worker.js"), "utf8") }),
        );
        writeFileSync(
            join(tests.scratch, "slow.html"),
            `<!doctype html><script>window.heard = []</script><script type="module" src="pbm-viewer.js"></script>
            <pbm-viewer id="viewer" src="fine.pbvg" style="width: 640px; height: 480px">`,
        );
        await page.goto(`${tests.server.url}/slow.html`);
        await atRest(page);
        const { samples, fineTime, exactPictureAfter } = await page.evaluate(() => viewer.statistics());
        assert.ok(exactPictureAfter > 1000, "nothing was decoded");
        assert.equal(samples, 8, `${fineTime} ms a sample`);
        await page.close();
    });
});

describe("input", () => {
    const press = (page) => page.mouse.move(160, 120).then(() => page.mouse.down());
    test("a button that is released where nobody tells ends the drag", () =>
        withPage(VIEWER, {}, async (page) => {
            await press(page);
            await page.mouse.move(180, 120);
            const turned = await orbit(page);
            // As after a release outside of a frame: the next motion comes without buttons.
            await page.evaluate(() =>
                viewer.shadowRoot.getElementById("input").dispatchEvent(
                    new PointerEvent("pointermove", { pointerId: 1, pointerType: "mouse", buttons: 0, clientX: 300, clientY: 120 }),
                ),
            );
            await page.mouse.move(250, 120);
            assert.deepEqual(await orbit(page), turned);
            await page.mouse.up();
        }));
    test("a pointer whose capture is lost ends the drag", () =>
        withPage(VIEWER, {}, async (page) => {
            await press(page);
            await page.mouse.move(180, 120);
            const turned = await orbit(page);
            await page.evaluate(() => viewer.shadowRoot.getElementById("input").releasePointerCapture(1));
            await page.mouse.move(190, 120);
            await page.mouse.move(250, 120);
            assert.ok(Math.abs((await orbit(page)).theta - turned.theta) < 0.2);
            await page.mouse.up();
        }));
    test("a vertical swipe scrolls the page and does not turn, a horizontal one turns", () =>
        withPage(`${VIEWER}</pbm-viewer><div style="height: 3000px"></div>`, { hasTouch: true, isMobile: true }, async (page) => {
            const client = await page.context().newCDPSession(page);
            const touch = (type, ...points) =>
                client.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y]) => ({ x, y })) });
            const before = await orbit(page);
            await touch("touchStart", [160, 200]);
            for (let y = 200; y >= 60; y -= 10) await touch("touchMove", [160 + (200 - y) / 5, y]);
            await touch("touchEnd");
            await page.waitForFunction(() => scrollY > 0);
            assert.deepEqual(await orbit(page), before);
            await page.evaluate(() => scrollTo(0, 0));
            await page.waitForTimeout(500); // the swipe has momentum
            await page.evaluate(() => scrollTo(0, 0));
            await touch("touchStart", [100, 120]);
            for (let x = 100; x <= 200; x += 10) await touch("touchMove", [x, 120 + (x - 100) / 5]);
            await touch("touchEnd");
            await page.waitForFunction((theta) => viewer.getCameraOrbit().theta < theta - 0.3, before.theta);
            assert.equal(await page.evaluate(() => scrollY), 0);
        }));
    test("at either end of the zoom the wheel scrolls the page", () =>
        withPage(`${VIEWER}</pbm-viewer><div style="height: 3000px"></div>`, {}, async (page) => {
            await page.mouse.move(160, 120);
            await page.mouse.wheel(0, 100);
            await page.waitForTimeout(100);
            assert.equal(await page.evaluate(() => scrollY), 0);
            await page.evaluate(() => viewer.setCamera({ orbit: "0deg 75deg 1000000%" }, { smooth: false }));
            await atRest(page);
            const { radius } = await orbit(page);
            await page.mouse.wheel(0, -100); // nearer
            await page.waitForFunction((radius) => viewer.getCameraOrbit().radius < radius, radius);
            await page.evaluate(() => viewer.setCamera({ orbit: "0deg 75deg 1000000%" }, { smooth: false }));
            await page.mouse.wheel(0, 100);
            await page.waitForFunction(() => scrollY > 0);
        }));
    test("drags and points are right in an element that CSS turns", () =>
        withPage(VIEWER, {}, async (page) => {
            const [x, y] = [130, 130];
            const plain = await page.evaluate(async ([x, y]) => String(await viewer.positionFromPoint(x, y)), [x, y]);
            assert.notEqual(plain, "null");
            const before = await orbit(page);
            // A quarter turn about the middle (160, 120) brings (x, y) to (160 - (y - 120), 120 + (x - 160)).
            await page.evaluate(() => (viewer.style.transform = "rotate(90deg)"));
            const turned = await page.evaluate(
                async ([x, y]) => String(await viewer.positionFromPoint(160 - (y - 120), 120 + (x - 160))),
                [x, y],
            );
            assert.equal(turned, plain);
            await page.mouse.move(160, 100);
            await page.mouse.down();
            for (let down = 0; down <= 60; down += 15) await page.mouse.move(160, 100 + down); // to the right in the element
            await page.mouse.up();
            const after = await orbit(page);
            assert.ok(Math.abs(after.theta - (before.theta - Math.PI / 4)) < 1e-6, `${after.theta - before.theta}`);
            assert.ok(Math.abs(after.phi - before.phi) < 1e-6);
        }));
});

describe("what prevents a picture is told", () => {
    test("a model that is cut anywhere", async () => {
        const bytes = readFileSync(buildStatue("whole.pbvg", 100000, 8));
        assert.ok(bytes.length > 60000, `${bytes.length} bytes`);
        // Of the longer ones the element shows a picture, too.
        for (const mode of ["ranges", "plain", "dropped"])
            for (const cut of [1600, 4000, 9000, 20000, 45000]) {
                const body = VIEWER.replace(MODEL, mode === "dropped" ? "" : `whole.pbvg?cut=${cut}&mode=${mode}`);
                await withPage(body, { wait: false }, async (page) => {
                    if (mode === "dropped")
                        await page.evaluate(async (part) => {
                            await customElements.whenDefined("pbm-viewer");
                            viewer.open(new Blob([Uint8Array.from(atob(part), (c) => c.charCodeAt(0))]));
                        }, bytes.subarray(0, cut).toString("base64"));
                    await awaitError(page);
                    assert.equal((await errors(page))[0].name, "header.size", `${mode}, ${cut}`);
                    assert.match(await notice(page), /cut short/);
                });
            }
    });
    test("promises settle without a worker", () =>
        withPage(VIEWER, { wait: false, missing: "view_worker.js" }, async (page) => {
            const settled = await page.evaluate(async () => {
                await customElements.whenDefined("pbm-viewer");
                const never = new Promise((resolve) => setTimeout(resolve, 20000, ["never"]));
                const ask = () => Promise.all([viewer.toBlob(), viewer.statistics(), viewer.positionFromPoint(1, 1)]);
                const first = await Promise.race([ask(), never]);
                return [...first, ...(await Promise.race([ask(), never]))];
            });
            assert.deepEqual(settled, [null, null, null, null, null, null]);
        }));
    for (const file of ["pbm.wasm", "view_worker.js"])
        test(`a server that fails once for ${file} is asked again, and nobody hears of it`, async () => {
            tests.server.faults.set(`/${file}`, [500]);
            await withPage(VIEWER, {}, async (page) => {
                assert.deepEqual(await errors(page), []);
                assert.equal(await notice(page), "");
            });
        });
    test("a server that allows other sites nothing is named, and its token is not", async () => {
        const other = await start();
        const body = VIEWER.replace(MODEL, `${other.server.url}/${MODEL}?closed=1&token=secret`);
        try {
            await withPage(body, { wait: false }, async (page) => {
                await awaitError(page);
                assert.equal((await errors(page))[0].name, "server.foreign");
                assert.equal(await notice(page), `${MODEL} is not loaded: its server allows other sites nothing (Access-Control-Allow-Origin).`);
            });
        } finally {
            await other.close();
        }
    });
    test("a policy that forbids the connection, the worker or WebAssembly is named", async () => {
        const usual = "default-src 'self' 'unsafe-inline'";
        const cases = [
            [`${usual}; script-src 'self' 'unsafe-inline'`, /'wasm-unsafe-eval'/],
            [`${usual} 'wasm-unsafe-eval'; worker-src 'none'`, /\(worker-src\)/],
            [`${usual} 'wasm-unsafe-eval'; connect-src ${tests.server.url}/pbm.wasm`, /^scan-everything.pbvg .*\(connect-src\)/],
        ];
        for (const [policy, message] of cases) {
            tests.server.policy = policy;
            try {
                await withPage(VIEWER, { wait: false }, async (page) => {
                    await awaitError(page);
                    assert.match(await notice(page), message);
                });
            } finally {
                tests.server.policy = null;
            }
        }
    });
    test("a frame without an origin shows the model, or its poster", async () => {
        writeFileSync(
            join(tests.scratch, "framed.html"),
            `<!doctype html><script type="module" src="pbm-viewer.js"></script>${VIEWER}<img slot="poster" src="poster.svg"></pbm-viewer>`,
        );
        const body = `<iframe sandbox="allow-scripts" src="framed.html" style="width: 400px; height: 300px"></iframe>`;
        await withPage(body, { wait: false }, async (page) => {
            const frame = page.frames()[1] ?? (await page.waitForEvent("frameattached"));
            await frame.waitForFunction(() => viewer.loaded || viewer.shadowRoot?.getElementById("message").textContent, null, {
                timeout: 20000,
            });
            assert.equal(await frame.evaluate(() => viewer.shadowRoot.getElementById("message").textContent), "");
        });
    });
    test("a notice has two lines at most", () =>
        withPage(VIEWER.replace(MODEL, `${"long-".repeat(40)}.pbvg?status=404`), { wait: false }, async (page) => {
            await awaitError(page);
            const lines = await page.locator("#message").evaluate((box) => box.clientHeight / parseFloat(getComputedStyle(box).lineHeight));
            assert.ok(lines < 2.1, `${lines} lines`);
        }));
    test("the bar tells the truth at 50 KB/s", async () => {
        buildStatue("statue.pbvg", 200000, 8);
        tests.server.rate = 50000;
        try {
            await withPage(VIEWER.replace(MODEL, "statue.pbvg"), { wait: false }, async (page) => {
                const samples = [];
                while (samples.at(-1)?.part !== 1) {
                    const part = await page.evaluate(
                        () => heard.filter(({ event }) => event === "progress").at(-1)?.totalProgress ?? 0,
                    );
                    samples.push({ part, time: performance.now() });
                    await page.waitForTimeout(200);
                }
                // A white edge is seen on dark pages.
                const edge = await page.locator("#bar").evaluate((bar) => getComputedStyle(bar).borderBottom);
                assert.equal(edge, "1px solid rgb(255, 255, 255)");
                const begin = samples[0].time;
                const all = samples.at(-1).time - begin;
                for (const { part, time } of samples)
                    assert.ok(Math.abs(part - (time - begin) / all) < 0.25, `${part} after ${time - begin} of ${all} ms`);
            });
        } finally {
            tests.server.rate = 0;
        }
    });
});

describe("policies", () => {
    test("trusted types are kept with one policy", async () => {
        tests.server.policy = "require-trusted-types-for 'script'; trusted-types pbm-viewer";
        try {
            await withPage(VIEWER, {}, async (page) => assert.deepEqual(page.faults, []));
        } finally {
            tests.server.policy = null;
        }
    });
    test("pages that --page writes, and that of the validator, keep a policy without inline styles", async () => {
        const model = join(golden, "1.0/scan-everything.pbvg");
        const site = join(tests.scratch, "site");
        execFileSync(join(programs, "pbm-render"), [model, "--page", site, "--quality", "fast", "-q"], {
            env: { ...process.env, PBM_WEB: package_ },
        });
        const sources = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self'";
        tests.server.policy = `${sources}; img-src 'self'; style-src 'self'`;
        try {
            for (const [path, done] of [
                // Until there is a picture for paper, too.
                ["site/index.html", () => document.querySelector("pbm-viewer").shadowRoot?.querySelector("#paper.ready")],
                ["validator.html", () => document.getElementById("verdict").textContent.endsWith(" is valid")],
            ]) {
                const page = await tests.browser.newPage();
                const faults = [];
                page.on("console", (message) => message.type() !== "log" && faults.push(message.text()));
                await page.goto(`${tests.server.url}/${path}`);
                if (path === "validator.html") await page.locator("#file").setInputFiles(model);
                await page.waitForFunction(done, null, { timeout: 30000 });
                assert.deepEqual(faults, []);
                await page.close();
            }
        } finally {
            tests.server.policy = null;
        }
    });
    test("a viewer on another server needs what the documentation says", async () => {
        const other = await start({ models: [tests.scratch] });
        const { url } = other.server;
        const policy = (worker) =>
            `<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src ${url} 'nonce-page' 'wasm-unsafe-eval';
            worker-src ${worker}; connect-src 'self' ${url}; style-src 'nonce-page'">`;
        try {
            await withPage(VIEWER, { from: `${url}/`, head: policy("blob:") }, async (page) => assert.deepEqual(page.faults, []));
        } finally {
            await other.close();
        }
    });
});

describe("people", () => {
    test("the element speaks the language of its page", () =>
        withPage(`<div lang="de-CH">${VIEWER.replace('alt="A sample"', "").replace(MODEL, `${MODEL}?status=404`)}</div>`, { wait: false }, async (page) => {
            await awaitError(page);
            assert.equal(await notice(page), `Der Server antwortete 404 Not Found für ${MODEL}.`);
            assert.equal((await errors(page))[0].message, `The server answered 404 Not Found for ${MODEL}.`);
            assert.match(await page.locator("#input").getAttribute("aria-label"), /^3D-Scan\. Pfeiltasten/);
            await page.getByRole("button", { name: "Schließen" }).click();
        }));
    test("the focus is seen in forced colours, and hidden hotspots are not in the order of keys", () =>
        withPage(VIEWER, { forcedColors: "active" }, async (page) => {
            await page.keyboard.press("Tab");
            const style = await page.locator("#input").evaluate((input) => getComputedStyle(input).outlineStyle);
            assert.equal(style, "solid");
            await page.evaluate(async () => {
                let point;
                for (let y = 120; !point; y += 4) point = await viewer.positionFromPoint(160, y);
                const back = viewer.info.voxelSize * 2 ** viewer.info.depth;
                viewer.innerHTML = `<button slot="hotspot-back" data-position="${point.x} ${point.y} ${point.z - back}" id="back">back</button>
                <button slot="hotspot-front" data-position="${point}" id="front">front</button>`;
            });
            await page.waitForFunction(() => front.hasAttribute("data-visible"));
            const reached = [];
            for (let i = 0; i < 4; ++i) {
                await page.keyboard.press("Tab");
                reached.push(await page.evaluate(() => document.activeElement.id));
            }
            assert.ok(reached.includes("front") && !reached.includes("back"), reached.join());
        }));
    test("buttons have at least 24 pixels", () =>
        withPage(VIEWER.replace(MODEL, `${MODEL}?status=404`), { wait: false }, async (page) => {
            await awaitError(page);
            for (const id of ["dismiss", "fullscreen"]) {
                const { width, height } = await page.locator(`#${id}`).boundingBox();
                assert.ok(width >= 24 && height >= 24, `${id}: ${width} x ${height}`);
            }
        }));
    test("a file that was dropped leaves a way back", () =>
        withPage(VIEWER, {}, async (page) => {
            const first = await pictureOf(page);
            assert.equal(await page.locator("#back").isVisible(), false);
            await page.evaluate(async () => viewer.open(await (await fetch("many-chunks.pbvg")).blob()));
            await atRest(page);
            assert.notDeepEqual((await pictureOf(page)).pixels, first.pixels);
            await page.getByRole("button", { name: "Back to the first model" }).click();
            await atRest(page);
            sameBytes(await pictureOf(page), first);
            assert.equal(await page.locator("#back").isVisible(), false);
        }));
    test("attributes as frameworks write them, and values that nobody knows", () =>
        withPage(VIEWER.replace("controls", 'controls="false" disable-zoom="false" quality="best" backs="none"').replace('quality="fast"', ""), {}, async (page) => {
            assert.deepEqual(await page.evaluate(() => [viewer.controls, viewer.disableZoom]), [false, false]);
            assert.equal(await page.locator("#input").getAttribute("role"), "img");
            const warnings = [];
            page.on("console", (message) => message.type() === "warning" && warnings.push(message.text()));
            await page.evaluate(() => (viewer.quality = "finest"));
            await atRest(page);
            assert.deepEqual(warnings, ['pbm-viewer: quality="finest" is none of auto, fast, fine']);
        }));
    test("height: auto gives the element a height", () =>
        withPage(VIEWER.replace(" id=", ' style="width: 320px; height: auto" id='), { wait: false }, async (page) => {
            await page.evaluate(() => customElements.whenDefined("pbm-viewer"));
            assert.equal(await page.evaluate(() => viewer.clientHeight), 240);
        }));
    test("the prompt goes with the first input", () =>
        withPage(VIEWER.replace("controls", 'controls interaction-prompt="auto"'), {}, async (page) => {
            const prompt = page.locator("#prompt");
            await prompt.waitFor({ state: "visible" });
            assert.equal(await prompt.innerText(), "Drag to turn");
            await page.mouse.move(160, 120);
            await page.mouse.down();
            await prompt.waitFor({ state: "hidden" });
            await page.mouse.up();
        }));
    test("a small element shows name and credit on request, full screen has the background of the page", async () => {
        buildStatue("credited.pbvg", 20000, 7, "--name", "Statue");
        const body = VIEWER.replace(MODEL, "credited.pbvg").replace(' background="#333"', "");
        await withPage(body, { head: "<style>body { background: rgb(20, 40, 60) }</style>" }, async (page) => {
            assert.equal(await page.locator("#credit").isVisible(), true);
            await page.evaluate(() => (viewer.style.cssText = "width: 200px !important; height: 150px !important"));
            assert.equal(await page.locator("#credit").isVisible(), false);
            await page.emulateMedia({ media: "print" });
            assert.equal(await page.locator("#credit").isVisible(), true);
            const [text, paper] = await page.locator("#credit bdi").evaluate((line) => {
                const { color, backgroundColor } = getComputedStyle(line);
                return [color, backgroundColor];
            });
            assert.deepEqual([text, paper], ["rgb(0, 0, 0)", "rgb(255, 255, 255)"]);
            await page.emulateMedia({ media: "screen" });
            await page.getByRole("button", { name: "Name and credit" }).click();
            assert.equal(await page.locator("#credit").innerText().then((text) => text.trim()), "Statue");
            await page.getByRole("button", { name: "Full screen" }).click();
            await page.waitForFunction(() => document.fullscreenElement === viewer);
            await atRest(page);
            const { pixels } = await pictureOf(page, await page.screenshot());
            assert.deepEqual([...pixels.subarray(4 * 640 * 20, 4 * 640 * 20 + 3)], [20, 40, 60]);
        });
    });
});
