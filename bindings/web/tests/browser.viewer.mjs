// The viewer in Chromium: what it shows, how it moves, and what its page hears.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { atRest, golden, pictureOf, programs, sameBytes, start } from "./browser.mjs";

const MODEL = "scan-everything.pbvg";
const VIEWER = `<pbm-viewer id="viewer" src="${MODEL}" controls alt="A sample" background="#333" quality="fast">`;
let tests;
before(async () => {
    tests = await start();
});
after(() => tests.close());

// Opens a page, and closes it after the test. No page may have complained.
async function withPage(body, options, check) {
    const page = await tests.open(body, options);
    try {
        await check(page);
        assert.deepEqual(page.faults, []);
    } finally {
        await page.close();
    }
}
const orbit = (page) => page.evaluate(() => ({ ...viewer.getCameraOrbit(), toString: undefined }));
// The picture of pbm-render of a golden model, as pictureOf gives it.
async function expectedOf(page, name, options) {
    const png = join(tests.scratch, "expected.png");
    const size = ["--resolution", "320,240"];
    execFileSync(join(programs, "pbm-render"), [join(golden, `${name}.pbvg`), "-o", png, ...size, ...options, "--quiet"]);
    return pictureOf(page, readFileSync(png));
}
const heard = (page, name) => page.evaluate((name) => heard.filter(({ event }) => event === name), name);

describe("pictures have the bytes of pbm-render", () => {
    const models = [
        "1.0/colour-565",
        "1.0/every-attribute",
        "1.0/filtered-regions",
        "1.0/many-chunks",
        "1.0/mapped-chunks",
        "1.0/plain-ground",
        "1.0/scan-everything",
        "1.0/shaded",
        "1.0/two-sided",
        "1.1/depth-16",
        "1.1/scan-fields",
        "1.2/scan-closed",
    ];
    for (const [i, name] of models.entries()) {
        test(name, async () => {
            const quality = i % 2 ? "fast" : "fine";
            const body = `<pbm-viewer id="viewer" src="${name.slice(4)}.pbvg" background="rgb(51, 51, 51)" quality="${quality}">`;
            await withPage(body, {}, async (page) =>
                sameBytes(await pictureOf(page), await expectedOf(page, name, ["--quality", quality])),
            );
        });
    }
    // Whatever else an attribute says is the default.
    for (const [name, attribute, values] of [
        ["1.0/colour-565", "backs", { show: ["show"], hide: ["hide"], none: [], auto: ["auto"] }],
        ["1.2/scan-closed", "backs", { show: ["show"], hide: ["hide"], "": [] }],
        ["1.0/scan-everything", "light-follows", { eye: ["eye"], sun: [], model: ["model"] }],
        ["1.0/scan-everything", "headlight", { "30deg": [], "-45deg 22.5deg": ["-45,22.5"], "400deg 0": [] }],
        ["1.1/scan-fields", "colour-by", { "": [], "height,-1,0.5,grey": ["height,-1,0.5,grey"] }],
    ]) {
        test(`with the attribute ${attribute}, of ${name}`, async () => {
            const body = `<pbm-viewer id="viewer" src="${name.slice(4)}.pbvg" background="#333" quality="fast">`;
            await withPage(body, {}, async (page) => {
                const usual = await pictureOf(page);
                let changes = 0;
                for (const [value, words] of Object.entries(values)) {
                    await page.evaluate(([name, value]) => viewer.setAttribute(name, value), [attribute, value]);
                    await atRest(page);
                    const picture = await pictureOf(page);
                    const option = words.map((word) => `--${attribute}=${word}`);
                    sameBytes(picture, await expectedOf(page, name, ["--quality", "fast", ...option]));
                    changes += picture.pixels.equals(usual.pixels) ? 0 : 1;
                }
                assert.equal(changes, 1, "one of the values changes the picture");
                await page.evaluate((name) => viewer.removeAttribute(name), attribute);
                await atRest(page);
                sameBytes(await pictureOf(page), usual);
                assert.deepEqual(await heard(page, "error"), []);
            });
        });
    }
    test("what is on the screen is the picture, to the pixel", () =>
        withPage(VIEWER.replace("controls", ""), {}, async (page) => {
            await page.waitForFunction(() => getComputedStyle(viewer.shadowRoot.getElementById("bar")).opacity === "0");
            const screen = await page.screenshot({ clip: { x: 0, y: 0, width: 320, height: 240 } });
            const shown = await pictureOf(page, screen);
            const expected = await pictureOf(page);
            // The credit covers the lower left corner.
            const upper = ({ width, height, pixels }) => ({
                width,
                height,
                pixels: pixels.subarray(0, width * 4 * (height - 40)),
            });
            sameBytes(upper(shown), upper(expected));
        }));
    test("a screen of two device pixels a CSS pixel gets all of them", () =>
        withPage(VIEWER, { deviceScaleFactor: 2 }, async (page) => {
            const { width, height } = await pictureOf(page);
            assert.deepEqual([width, height], [640, 480]);
        }));
});

describe("input", () => {
    // Moves the mouse from the middle of the viewer.
    async function drag(page, right, down, options = {}) {
        await page.mouse.move(160, 120);
        await page.mouse.down(options);
        for (let i = 1; i <= 4; ++i) await page.mouse.move(160 + (right * i) / 4, 120 + (down * i) / 4);
        await page.mouse.up(options);
        await atRest(page);
    }
    test("a drag turns the view, Home brings the first picture back", () =>
        withPage(VIEWER, {}, async (page) => {
            const first = await pictureOf(page);
            const before = await orbit(page);
            await drag(page, 60, 24);
            const after = await orbit(page);
            assert.ok(Math.abs(after.theta - (before.theta - Math.PI / 4)) < 1e-6);
            assert.ok(Math.abs(after.phi - (before.phi - Math.PI / 10)) < 1e-6);
            assert.notDeepEqual((await pictureOf(page)).pixels, first.pixels);
            assert.ok((await heard(page, "camera-change")).some((event) => event.source === "user-interaction"));
            await page.keyboard.press("Home");
            await atRest(page);
            sameBytes(await pictureOf(page), first);
        }));
    test("the right button and shift move the target", () =>
        withPage(VIEWER, {}, async (page) => {
            const target = () => page.evaluate(() => String(viewer.getCameraTarget()));
            const first = await target();
            await drag(page, 40, 0, { button: "right" });
            const second = await target();
            assert.notEqual(second, first);
            await page.keyboard.down("Shift");
            await drag(page, 0, 40);
            assert.notEqual(await target(), second);
            assert.equal((await orbit(page)).theta, 0);
        }));
    test("the wheel zooms, and scrolls the page if zoom is disabled", () =>
        withPage(`<div style="height: 3000px">${VIEWER}`, {}, async (page) => {
            const { radius } = await orbit(page);
            await page.mouse.move(160, 120);
            await page.mouse.wheel(0, -100);
            await page.waitForFunction((radius) => viewer.getCameraOrbit().radius < radius * 0.9, radius);
            assert.equal(await page.evaluate(() => scrollY), 0);
            await page.evaluate(() => viewer.setAttribute("disable-zoom", ""));
            await page.mouse.wheel(0, 100);
            await page.waitForFunction(() => scrollY > 0);
        }));
    test("no zoom leads through the surface", () =>
        withPage(VIEWER, {}, async (page) => {
            await page.mouse.move(150, 110);
            const point = () => page.evaluate(async () => (await viewer.positionFromPoint(150, 110)) && true);
            assert.ok(await point(), "there is no surface to zoom at");
            for (let i = 0; i < 40; ++i) {
                await page.mouse.wheel(0, -200);
                await page.waitForTimeout(40);
            }
            await atRest(page);
            assert.ok(await point(), "the view is behind the surface");
        }));
    test("keys turn, move and zoom", () =>
        withPage(VIEWER, {}, async (page) => {
            await page.keyboard.press("Tab");
            const first = await orbit(page);
            for (let i = 0; i < 4; ++i) await page.keyboard.press("ArrowRight");
            await page.keyboard.press("ArrowUp");
            await page.keyboard.press("+");
            await atRest(page);
            const turned = await orbit(page);
            assert.ok(turned.theta < first.theta && turned.phi > first.phi && turned.radius < first.radius);
            assert.match(
                await page.evaluate(() => viewer.shadowRoot.getElementById("spoken").textContent),
                /^View from the .*left/,
            );
            const target = await page.evaluate(() => String(viewer.getCameraTarget()));
            await page.keyboard.press("Shift+ArrowLeft");
            assert.notEqual(await page.evaluate(() => String(viewer.getCameraTarget())), target);
        }));
    test("a double click looks at the point under the mouse", () =>
        withPage(VIEWER, {}, async (page) => {
            const point = await page.evaluate(async () => {
                for (let y = 20; y < 240; y += 10)
                    for (let x = 20; x < 320; x += 10) {
                        const point = await viewer.positionFromPoint(x, y);
                        if (point && Math.hypot(x - 160, y - 120) > 20) return { x, y, text: String(point) };
                    }
            });
            await page.mouse.dblclick(point.x, point.y);
            await page.waitForFunction((text) => String(viewer.getCameraTarget()) === text, point.text);
            await atRest(page);
            const [seen, eye] = await page.evaluate(async () => {
                const seen = await viewer.positionFromPoint(160, 120);
                return [[seen.x, seen.y, seen.z], viewer.info.voxelSize];
            });
            const wanted = point.text.split(" ").map(Number);
            assert.ok(Math.hypot(...seen.map((x, i) => x - wanted[i])) < 8 * eye);
        }));
    test("two fingers pinch, one finger turns sideways and scrolls the page up and down", () =>
        withPage(`<div style="height: 3000px">${VIEWER}`, { hasTouch: true, isMobile: true }, async (page) => {
            const client = await page.context().newCDPSession(page);
            const touch = (type, ...points) =>
                client.send("Input.dispatchTouchEvent", {
                    type,
                    touchPoints: points.map(([x, y], id) => ({ x, y, id })),
                });
            const before = await orbit(page);
            await touch("touchStart", [140, 120], [180, 120]);
            for (let d = 20; d <= 60; d += 10) await touch("touchMove", [160 - d, 120], [160 + d, 120]);
            await touch("touchEnd");
            await page.waitForFunction((radius) => viewer.getCameraOrbit().radius < radius / 2, before.radius);
            const pinched = await orbit(page);
            assert.ok(Math.abs(pinched.theta - before.theta) < 1e-9);
            await touch("touchStart", [160, 120]);
            for (let x = 160; x <= 240; x += 10) await touch("touchMove", [x, 120]);
            await touch("touchEnd");
            await page.waitForFunction((theta) => viewer.getCameraOrbit().theta < theta - 0.3, pinched.theta);
            const turned = await orbit(page);
            await touch("touchStart", [160, 200]);
            for (let y = 200; y >= 60; y -= 10) await touch("touchMove", [160, y]);
            await touch("touchEnd");
            await page.waitForFunction(() => scrollY > 0);
            assert.ok(Math.abs((await orbit(page)).phi - turned.phi) < 0.3);
        }));
    test("without controls nothing moves, and the element is a picture", () =>
        withPage(VIEWER.replace("controls", ""), {}, async (page) => {
            const before = await orbit(page);
            await drag(page, 60, 20);
            await page.mouse.wheel(0, 100);
            await page.keyboard.press("ArrowLeft");
            assert.deepEqual(await orbit(page), before);
            const input = page.locator("#input");
            assert.equal(await input.getAttribute("role"), "img");
            assert.equal(await input.getAttribute("aria-label"), "A sample");
        }));
});

describe("the page", () => {
    test("hears load once and progress up to 1", () =>
        withPage(VIEWER, {}, async (page) => {
            await page.waitForFunction(() => heard.some((event) => event.totalProgress === 1));
            const loads = await heard(page, "load");
            assert.deepEqual(
                loads.map((event) => event.url),
                [`${tests.server.url}/${MODEL}`],
            );
            const progress = (await heard(page, "progress")).map((event) => event.totalProgress);
            assert.deepEqual(progress, [...progress].sort());
            assert.equal(progress.filter((part) => part === 1).length, 1);
            assert.deepEqual(await heard(page, "error"), []);
        }));
    test("attributes decide the view, and may change", () =>
        withPage(
            VIEWER.replace(
                "controls",
                'camera-orbit="90deg 60deg 200%" field-of-view="20deg" camera-target="0 auto 0"',
            ),
            {},
            async (page) => {
                const first = await orbit(page);
                assert.ok(Math.abs(first.theta - Math.PI / 2) < 1e-9 && Math.abs(first.phi - Math.PI / 3) < 1e-9);
                assert.ok(Math.abs((await page.evaluate(() => viewer.getFieldOfView())) - 20) < 1e-9);
                const one = await pictureOf(page);
                await page.evaluate(() => viewer.setAttribute("camera-orbit", "auto auto auto"));
                await atRest(page);
                assert.equal((await orbit(page)).theta, 0);
                await page.evaluate(() => viewer.setCamera({ orbit: "90deg 60deg 200%" }, { smooth: false }));
                await atRest(page);
                sameBytes(await pictureOf(page), one);
            },
        ));
    test("100% shows the whole model in elements of any shape, also of a shape that changes", async () => {
        // Points of an edge of the picture that show something.
        const touched = (page) =>
            page.evaluate(async () => {
                const { width, height } = viewer.getBoundingClientRect();
                let count = 0;
                for (const part of [0.002, 0.998])
                    for (let along = 0; along < 1; along += 0.01) {
                        if (await viewer.positionFromPoint(part * width, along * height)) ++count;
                        if (await viewer.positionFromPoint(along * width, part * height)) ++count;
                    }
                return count;
            });
        const wide = join(tests.scratch, "wide.ply");
        const points = [];
        for (let x = -60; x <= 60; ++x) for (let z = -60; z <= 60; ++z) points.push(`${x} ${(x * z) % 3} ${z}`);
        const head = ["ply", "format ascii 1.0", `element vertex ${points.length}`];
        const properties = ["x", "y", "z"].map((axis) => `property float ${axis}`);
        writeFileSync(wide, [...head, ...properties, "end_header", ...points, ""].join("\n"));
        execFileSync(join(programs, "pbm-build"), [wide, "-o", join(tests.scratch, "wide.pbvg"), "--depth", "6", "-q"]);
        const body = VIEWER.replace(MODEL, "wide.pbvg").replace("controls", 'camera-orbit="20deg 75deg 100%"');
        await withPage(body.replace(" id=", ' style="width: 100px; height: 240px" id='), {}, async (page) => {
            assert.equal(await touched(page), 0);
            const { radius } = await orbit(page);
            await page.evaluate(() => viewer.setAttribute("style", "width: 320px; height: 240px"));
            await atRest(page);
            assert.equal(await touched(page), 0);
            const wider = await orbit(page);
            assert.ok(wider.radius < radius / 2);
            await page.evaluate(() => viewer.resetCamera({ smooth: false }));
            assert.ok(Math.abs((await orbit(page)).radius / wider.radius - 1) < 1e-9);
            await page.evaluate(() => viewer.setCamera({ orbit: "20deg 75deg 50%" }, { smooth: false }));
            await atRest(page);
            assert.notEqual(await touched(page), 0);
        });
    });
    test("properties mirror attributes, also those set before the code was there", async () => {
        const early = '<pbm-viewer id="viewer">';
        const late = `<script type="module">
            Object.assign(viewer, { src: "${MODEL}", controls: true });
            import("./pbm-viewer.js");
        </script>`;
        await withPage(early + late, { from: "data:text/javascript,//" }, async (page) => {
            assert.deepEqual(await page.evaluate(() => [viewer.getAttribute("src"), viewer.getAttribute("controls")]), [
                MODEL,
                "",
            ]);
            const names = await page.evaluate(() => {
                const texts =
                    "alt poster quality backs cameraOrbit cameraTarget fieldOfView background shading lightFollows headlight colourBy dropClass showClass loading reveal touchAction interactionPrompt";
                const given = {
                    ...Object.fromEntries(texts.split(" ").map((name) => [name, "auto"])),
                    background: "#333",
                    maxMemory: 300,
                    exposure: -0.5,
                    autoRotate: true,
                    controls: false,
                    disableZoom: true,
                    noLegend: true,
                };
                Object.assign(viewer, given);
                const wrong = Object.keys(given).filter((name) => viewer[name] !== given[name]);
                const names = viewer.getAttributeNames();
                for (const name of texts.split(" ")) viewer[name] = null;
                return { wrong, names, left: viewer.getAttributeNames() };
            });
            const others = ["auto-rotate", "disable-zoom", "exposure", "id", "max-memory", "no-legend", "src"];
            const texts = ["alt", "background", "backs", "camera-orbit", "camera-target", "field-of-view", "light-follows"];
            const words = ["shading", "headlight", "colour-by", "drop-class", "show-class", "loading", "poster", "quality", "reveal", "touch-action", "interaction-prompt"];
            assert.deepEqual(names.wrong, []);
            assert.deepEqual(names.names.sort(), [...others, ...texts, ...words].sort());
            assert.deepEqual(names.left.sort(), others);
            page.faults.length = 0; // the poster "auto" is not there
        });
    });
    test("a wrong attribute is told and ignored", async () => {
        const page = await tests.open(VIEWER.replace("controls", 'camera-orbit="30 auto auto"'));
        assert.match(page.faults.join(), /"30" is no angle: write 30deg/);
        assert.equal((await orbit(page)).theta, 0);
        await page.close();
    });
    test("a camera that is no number is told, and the next one is shown", async () => {
        const page = await tests.open(VIEWER);
        for (const [name, value] of [
            ["camera-orbit", "1e999deg 75deg 100%"],
            ["camera-target", "1e999 0 0"],
            ["field-of-view", ".deg"],
        ]) {
            await page.evaluate(([name, value]) => viewer.setAttribute(name, value), [name, value]);
            await page.evaluate((name) => viewer.removeAttribute(name), name);
        }
        assert.equal(page.faults.filter((text) => /write/.test(text)).length, 3);
        await page.evaluate(() => viewer.setAttribute("camera-orbit", "20deg 75deg 100%"));
        await atRest(page);
        assert.ok(Math.abs((await orbit(page)).theta - Math.PI / 9) < 1e-9);
        assert.deepEqual(await heard(page, "error"), []);
        await page.close();
    });
    const resize = (page, width, height) =>
        page.evaluate((css) => (viewer.style.cssText = css), `width: ${width}px !important; height: ${height}px !important`);
    test("pictures have no more than 32768 columns", () =>
        withPage(VIEWER, {}, async (page) => {
            await resize(page, 40000, 20);
            await page.waitForFunction(async () => (await viewer.statistics()).width === 32768);
            assert.deepEqual(await heard(page, "error"), []);
        }));
    test("a picture that is too large for memory is told once, and the next one is shown", () =>
        withPage(VIEWER, {}, async (page) => {
            await resize(page, 32768, 16400);
            await page.waitForFunction(() => heard.some(({ event }) => event === "error"));
            await resize(page, 320, 240);
            await atRest(page);
            assert.equal(await page.evaluate(async () => (await viewer.statistics()).width), 320);
            const errors = await heard(page, "error");
            assert.deepEqual(
                errors.map(({ code, name }) => [code, name]),
                [[4, "system.memory"]],
            );
            assert.equal(await page.locator("#message").innerText(), "");
        }));
    test("a view that needs more than max-memory is told until another one is complete", () =>
        withPage(VIEWER.replace("controls", 'max-memory="0.01"'), {}, async (page) => {
            const look = async (orbit) => {
                await page.evaluate((orbit) => viewer.setCamera({ orbit }, { smooth: false }), orbit);
                await atRest(page);
                return page.locator("#message").innerText();
            };
            assert.match(await look("auto auto 20%"), /more than the 0.01 MB that max-memory allows/);
            assert.equal(await look("auto auto 5000%"), "");
            assert.match(await look("auto auto 20%"), /max-memory/);
            assert.equal((await heard(page, "error")).length, 2);
        }));
    for (const memory of ["Infinity", "-1", "none", "1e300"])
        test(`max-memory="${memory}" leaves a viewer that works`, async () => {
            const page = await tests.open(VIEWER.replace("controls", `max-memory="${memory}"`));
            assert.deepEqual(await heard(page, "error"), []);
            const isWrong = memory === "-1" || memory === "none";
            assert.equal(/max-memory.*no number of MB/.test(page.faults.join()), isWrong);
            await page.close();
        });
    test("hotspots stay at their point and hide behind the model", () =>
        withPage(VIEWER, {}, async (page) => {
            // A point of the surface, and one behind the model as far away as the model is large.
            await page.evaluate(async () => {
                let point;
                for (let y = 120; !point; y += 4) point = await viewer.positionFromPoint(160, y);
                const back = viewer.info.voxelSize * 2 ** viewer.info.depth;
                viewer.innerHTML = `<button slot="hotspot-front" data-position="${point}" id="front">front</button>
                <button slot="hotspot-back" data-position="${point.x} ${point.y} ${point.z - back}" id="back">back</button>
                <button slot="hotspot-wrong" data-position="1 2" id="wrong">wrong</button>`;
            });
            await page.waitForFunction(() => front.hasAttribute("data-visible"));
            const middle = await page.evaluate(() => {
                const { left, right } = front.getBoundingClientRect();
                return (left + right) / 2;
            });
            assert.ok(Math.abs(middle - 160) <= 1.5);
            assert.equal(await page.evaluate(() => back.hasAttribute("data-visible")), false);
            await page.evaluate(() => {
                front.addEventListener("hotspot-visibility", (event) => {
                    window.told = event.detail.visible;
                });
                viewer.setCamera({ orbit: "180deg 90deg 100%" });
            });
            await page.waitForFunction(() => !front.hasAttribute("data-visible") && window.told === false);
            assert.match(page.faults.splice(0).join(), /hotspot-wrong.*three/);
        }));
    test("a snapshot is a PNG or JPEG of the picture", () =>
        withPage(VIEWER, {}, async (page) => {
            const heads = await page.evaluate(async () =>
                Promise.all(
                    ["image/png", "image/jpeg"].map(async (mimeType) => {
                        const blob = await viewer.toBlob({ mimeType, qualityArgument: 0.8 });
                        return [blob.type, ...new Uint8Array(await blob.slice(0, 3).arrayBuffer())];
                    }),
                ),
            );
            assert.deepEqual(heads, [
                ["image/png", 0x89, 0x50, 0x4e],
                ["image/jpeg", 0xff, 0xd8, 0xff],
            ]);
        }));
    test("a snapshot after a change of the view shows the changed view", () =>
        withPage(VIEWER, {}, async (page) => {
            const [sizes, same] = await page.evaluate(async () => {
                const first = await viewer.toBlob();
                viewer.setCamera({ orbit: "120deg 60deg 50%" }, { smooth: false });
                const changed = await viewer.toBlob();
                await new Promise((resolve) => setTimeout(resolve, 300));
                const later = await viewer.toBlob();
                const texts = await Promise.all([changed, later].map((blob) => blob.arrayBuffer()));
                const [one, other] = texts.map((bytes) => new Uint8Array(bytes).join());
                return [[first.size, changed.size], one === other];
            });
            assert.notEqual(sizes[0], sizes[1]);
            assert.ok(same);
        }));
    test("two viewers have a worker each, and an element that goes takes its worker along", () =>
        withPage(VIEWER + '</pbm-viewer><pbm-viewer id="other" src="many-chunks.pbvg">', {}, async (page) => {
            await atRest(page, "other");
            assert.equal(page.workers().length, 2);
            assert.notDeepEqual((await pictureOf(page)).pixels, (await pictureOf(page, "other")).pixels);
            await page.evaluate(() => document.body.append(viewer));
            assert.equal(page.workers().length, 2);
            await page.evaluate(() => viewer.remove());
            for (let i = 0; page.workers().length > 1 && i < 50; ++i) await page.waitForTimeout(20);
            assert.equal(page.workers().length, 1);
        }));
    test("a hidden page is not drawn, and drawn once it is shown", () =>
        withPage(VIEWER.replace(MODEL, "scan-plain.pbvg"), {}, async (page) => {
            const hide = (hidden) =>
                page.evaluate((hidden) => {
                    Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
                    document.dispatchEvent(new Event("visibilitychange"));
                }, hidden);
            const corner = async () => (await pictureOf(page, await page.screenshot())).pixels.subarray(0, 3).join();
            await hide(true);
            await page.evaluate(() => viewer.setAttribute("background", "rgb(1, 200, 3)"));
            await page.waitForTimeout(400);
            assert.equal(await corner(), "51,51,51");
            await hide(false);
            await page.waitForTimeout(100);
            await atRest(page);
            assert.equal(await corner(), "1,200,3");
        }));
    test("a lazy viewer loads when the page comes near it, an eager one at once", () =>
        withPage(
            `<div style="height: 3000px"></div>${VIEWER}</pbm-viewer>
         <pbm-viewer id="eager" loading="eager" src="many-chunks.pbvg">`,
            { wait: false },
            async (page) => {
                await atRest(page, "eager");
                assert.equal(await page.evaluate(() => viewer.loaded), false);
                assert.equal(page.workers().length, 1);
                await page.evaluate(() => viewer.scrollIntoView());
                await atRest(page);
            },
        ));
    test("a poster is shown until the model is, or until it is dismissed", async () => {
        const poster =
            "data:image/svg+xml,<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'><rect width='9' height='9' fill='lime'/></svg>";
        const opacity = (page) =>
            page.evaluate(() => getComputedStyle(viewer.shadowRoot.getElementById("poster")).opacity);
        const body = VIEWER.replace("controls", `poster="${poster}"`);
        await withPage(body.replace(MODEL, `${MODEL}?delay=1500`), { wait: false }, async (page) => {
            await page.waitForFunction(() => viewer.shadowRoot?.querySelector("#poster img")?.complete);
            assert.equal(await opacity(page), "1");
            await atRest(page);
            await page.waitForFunction(
                () => getComputedStyle(viewer.shadowRoot.getElementById("poster")).opacity === "0",
            );
        });
        await withPage(body.replace("poster=", 'reveal="manual" poster='), {}, async (page) => {
            assert.equal(await opacity(page), "1");
            // The poster does not fill the element: beside it there is no model either.
            const narrow = { x: 0, y: 4, width: 39, height: 190 };
            const beside = await pictureOf(page, await page.screenshot({ clip: narrow }));
            assert.ok(beside.pixels.every((byte) => byte === 255));
            await page.evaluate(() => viewer.dismissPoster());
            await page.waitForFunction(
                () => getComputedStyle(viewer.shadowRoot.getElementById("poster")).opacity === "0",
            );
            // What is computed is on the screen two frames later.
            await page.evaluate(
                () => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))),
            );
            const clip = { x: 0, y: 0, width: 320, height: 200 };
            const shown = await pictureOf(page, await page.screenshot({ clip }));
            const { pixels } = await pictureOf(page);
            sameBytes(shown, { width: 320, height: 200, pixels: pixels.subarray(0, 320 * 200 * 4) });
        });
    });
    test("a file that is dropped is shown", () =>
        withPage(
            '<pbm-viewer id="viewer" controls background="#333" quality="fast">',
            { wait: false },
            async (page) => {
                await page.evaluate(async (name) => {
                    const transfer = new DataTransfer();
                    transfer.items.add(new File([await (await fetch(name)).blob()], name));
                    await customElements.whenDefined("pbm-viewer");
                    viewer.dispatchEvent(
                        new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }),
                    );
                }, MODEL);
                await atRest(page);
                const dropped = await pictureOf(page);
                await page.evaluate((name) => viewer.setAttribute("src", name), MODEL);
                await atRest(page);
                sameBytes(await pictureOf(page), dropped);
            },
        ));
    test("whom the model is owed to is written on it", async () => {
        const credited = join(tests.scratch, "credited.pbvg");
        execFileSync(join(programs, "pbm-sample"), [
            "--shape",
            "statue",
            "--points",
            "20000",
            "--normals",
            "-o",
            `${credited}.ply`,
            "-q",
        ]);
        execFileSync(join(programs, "pbm-build"), [
            `${credited}.ply`,
            "-o",
            credited,
            "--depth",
            "7",
            "-q",
            "--name",
            "<b>Statue</b>",
            "--credit",
            "A. Sculptor <https://example.org/a?b=1&c=2>",
            "--licence",
            "CC0 javascript:alert(1)",
        ]);
        await withPage('<pbm-viewer id="viewer" src="credited.pbvg">', {}, async (page) => {
            const credit = page.locator("#credit");
            assert.match(await credit.innerText(), /<b>Statue<\/b>[^]*A\. Sculptor[^]*CC0 javascript:alert\(1\)/);
            assert.deepEqual(await credit.locator("a").evaluateAll((links) => links.map((link) => link.href)), [
                "https://example.org/a?b=1&c=2",
            ]);
        });
    });
    test("auto-rotate turns the view, unless motion is to be reduced", async () => {
        const body = VIEWER.replace("controls", "auto-rotate");
        await withPage(body, { wait: false }, async (page) => {
            await page.waitForFunction(() => viewer.loaded && viewer.getCameraOrbit().theta > 0.01, null, {
                timeout: 20000,
            });
            assert.deepEqual(
                await page.evaluate(() => heard.filter((event) => event.source === "user-interaction")),
                [],
            );
        });
        await withPage(body, { reducedMotion: "reduce" }, async (page) => {
            await page.waitForTimeout(3500);
            assert.equal((await orbit(page)).theta, 0);
        });
    });
    test("full screen", () =>
        withPage(VIEWER, {}, async (page) => {
            await page.getByRole("button", { name: "Full screen" }).click();
            await page.waitForFunction(() => document.fullscreenElement === viewer && viewer.clientWidth > 320);
            await atRest(page);
            assert.equal((await pictureOf(page)).width, await page.evaluate(() => viewer.clientWidth));
        }));
    test("browsers whose workers cannot draw show the same", () =>
        withPage(VIEWER, {}, async (page) => {
            const expected = await pictureOf(page);
            await withPage(
                VIEWER,
                { head: "<script>delete HTMLCanvasElement.prototype.transferControlToOffscreen</script>" },
                async (other) => sameBytes(await pictureOf(other), expected),
            );
        }));
    test("a strict Content-Security-Policy is kept", () =>
        withPage(
            VIEWER,
            {
                head: `<meta http-equiv="Content-Security-Policy"
        content="default-src 'none'; script-src 'self' 'nonce-page' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self';
        style-src 'nonce-page'">`,
            },
            async (page) => {
                assert.equal(await page.locator("#input").evaluate((input) => getComputedStyle(input).cursor), "grab");
            },
        ));
    test("a page that is isolated draws with threads, and the same picture", async () => {
        await withPage(VIEWER, {}, async (page) => {
            const expected = await pictureOf(page);
            assert.equal((await page.evaluate(() => viewer.statistics())).threads > 1, false);
            tests.server.isolated = true;
            try {
                await withPage(VIEWER, {}, async (other) => {
                    assert.ok((await other.evaluate(() => viewer.statistics())).threads > 1);
                    sameBytes(await pictureOf(other), expected);
                });
            } finally {
                tests.server.isolated = false;
            }
        });
    });
});
