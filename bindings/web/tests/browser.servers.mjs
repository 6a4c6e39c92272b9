// The viewer on servers good and bad, and on files that are damaged: what is proven is shown, and the rest is named.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { atRest, pictureOf, programs, sameBytes, start } from "./browser.mjs";

const FIRST = 65536; // bytes of the first request
let tests;
let size;
let expected;
let lastByte; // that the picture needs
before(async () => {
    tests = await start();
    const model = join(tests.scratch, "statue.pbvg");
    execFileSync(join(programs, "pbm-sample"), [
        "--shape",
        "statue",
        "--points",
        "300000",
        "--normals",
        "-o",
        `${model}.ply`,
        "-q",
    ]);
    execFileSync(join(programs, "pbm-build"), [`${model}.ply`, "-o", model, "--depth", "9", "-q"]);
    size = readFileSync(model).length;
    const page = await show("");
    expected = await pictureOf(page);
    lastByte = Math.max(...requests().map((entry) => +entry.range.split("-")[1]));
    await page.close();
});
after(() => tests.close());

// A page with the model, asked for with this query.
async function show(query, options = {}) {
    tests.server.log.length = 0;
    return tests.open(
        `<pbm-viewer id="viewer" quality="fast" background="#333" controls camera-orbit="auto auto 45%" src="statue.pbvg${query}">`,
        options,
    );
}
const errors = (page) => page.evaluate(() => heard.filter(({ event }) => event === "error"));
// What the notices of all viewers say, from the beginning.
const LISTEN = `<script nonce="page">window.notices = [];
    customElements.whenDefined("pbm-viewer").then(() => {
        const box = viewer.shadowRoot.getElementById("message");
        new MutationObserver(() => box.textContent && notices.push(box.textContent)).observe(box, { childList: true });
    });</script>`;
const requests = () => tests.server.log.filter((entry) => entry.path === "/statue.pbvg");
const sent = () => requests().reduce((sum, entry) => sum + entry.sent, 0);
const notice = (page) => page.locator("#message").innerText();

describe("servers", () => {
    test("ranges: few requests, no byte twice, and no more than the picture needs", async () => {
        const page = await show("");
        sameBytes(await pictureOf(page), expected);
        assert.equal(requests()[0].range, `bytes=0-${FIRST - 1}`);
        assert.ok(requests().every((entry) => entry.status === 206));
        assert.ok(requests().length <= 7, `${requests().length} requests`);
        assert.ok(sent() <= size);
        assert.deepEqual(await errors(page), []);
        await page.close();
    });
    test("ranges: a view that comes nearer asks for the rest", async () => {
        const page = await show("", {
            head: "<style>pbm-viewer { width: 64px !important; height: 48px !important }</style>",
        });
        const first = sent();
        assert.ok(first < size, "the small picture needs all of the model");
        await page.evaluate(() => viewer.setCamera({ orbit: "auto auto 20%" }, { smooth: false }));
        await atRest(page);
        assert.ok(sent() > first);
        await page.close();
    });
    for (const [query, what, statuses] of [
        ["?mode=plain", "without ranges", [200]],
        ["?mode=longer", "that sends more than it was asked for", [206, 200]],
        ["?mode=elsewhere", "that states another range", [206, 200]],
    ]) {
        test(`a server ${what} gives the same picture`, async () => {
            const page = await show(query);
            sameBytes(await pictureOf(page), expected);
            assert.deepEqual(
                requests().map((entry) => entry.status),
                statuses,
            );
            assert.deepEqual(await errors(page), []);
            await page.close();
        });
    }
    for (const query of ["?mode=shorter", "?hidden=1"]) {
        test(`a server that is odd (${query}) gives the same picture`, async () => {
            const page = await show(query);
            sameBytes(await pictureOf(page), expected);
            assert.ok(sent() <= size);
            await page.close();
        });
    }
    test("a server that compresses every answer gives the same picture", async () => {
        const page = await show("?mode=gzip");
        sameBytes(await pictureOf(page), expected);
        assert.equal(requests().at(-1).range, null);
        assert.deepEqual(await errors(page), []);
        await page.close();
    });
    for (const address of ["http://[", "http://user:word@localhost/", "foo:bar", "javascript:alert(1)", "blob:null/1"])
        test(`the address ${address} is an error`, async () => {
            const page = await tests.open(`<pbm-viewer id="viewer" src="${address}">`, { wait: false });
            await page.waitForFunction(() => heard.some(({ event }) => event === "error"));
            assert.deepEqual(
                (await errors(page)).map(({ name }) => name),
                ["address"],
            );
            // It names what it can, and never a password.
            assert.ok((await notice(page)).includes(address.includes("word") ? "localhost" : address));
            assert.ok(!(await notice(page)).includes("word"));
            assert.ok(page.faults.every((fault) => /^(Fetch API|Not allowed|Failed to load resource)/.test(fault)), page.faults.join());
            await page.close();
        });
    test("a streamed file is drawn as it arrives, coarse first", async () => {
        const page = await show(`?mode=plain&rate=${Math.round(size / 3)}`, { wait: false });
        await page.waitForFunction(() => viewer.loaded, null, { timeout: 20000 });
        assert.ok(sent() < size, "the first picture waited for the whole file");
        const early = await pictureOf(page);
        await atRest(page);
        sameBytes(await pictureOf(page), expected);
        assert.notDeepEqual(early.pixels, expected.pixels);
        await page.close();
    });
    test("bytes of another place are damage, which is named; the rest is shown", async () => {
        const page = await show("?mode=other", { wait: false });
        await page.waitForFunction(() => heard.some(({ event }) => event === "error"));
        const [error] = await errors(page);
        assert.deepEqual([error.code, error.name], [3, "hash.chunk"]);
        assert.ok(error.offset > 0);
        assert.match(await notice(page), /^Not all of this model can be shown/);
        await page.getByRole("button", { name: "Close" }).click();
        assert.equal(await page.locator("#notice").isVisible(), false);
        await page.close();
    });
    for (const mode of ["ranges", "plain"]) {
        test(`a connection that breaks once is continued, and nobody hears of it (${mode})`, async () => {
            const page = await show(`?mode=${mode}&drop=${mode === "plain" ? 100000 : 30000}`, { head: LISTEN });
            sameBytes(await pictureOf(page), expected);
            assert.ok(requests().length > 1);
            assert.deepEqual(await page.evaluate(() => notices), []);
            assert.deepEqual(await errors(page), []);
            await page.close();
        });
    }
    test("a server that goes away in the middle, and comes back", async () => {
        const page = await show("?rate=150000", { wait: false });
        await page.waitForFunction(() => viewer.loaded, null, { timeout: 20000 });
        tests.server.down = true;
        tests.server.breakConnections();
        await page
            .waitForFunction(() => heard.some(({ event }) => event === "error"), null, { timeout: 20000 })
            .finally(() => {
                tests.server.down = false;
            });
        assert.deepEqual(
            (await errors(page)).map(({ name, code }) => [name, code]),
            [["network", 2]],
        );
        await atRest(page);
        sameBytes(await pictureOf(page), expected);
        assert.ok(sent() < size + 2 * FIRST, "bytes were sent twice");
        await page.close();
    });
    test("a browser that is offline for a while", async () => {
        const page = await show("?rate=100000", { wait: false });
        await page.waitForFunction(() => viewer.loaded, null, { timeout: 20000 });
        await page.context().setOffline(true);
        await page.waitForFunction(() =>
            viewer.shadowRoot.getElementById("message").textContent.includes("tries again"),
        );
        await page.context().setOffline(false);
        await atRest(page);
        sameBytes(await pictureOf(page), expected);
        await page.close();
    });
    test("a page in place of the rest of the file is an error", async () => {
        const page = await show("?mode=replaced", { wait: false });
        await page.waitForFunction(() => heard.some(({ name }) => name === "server.changed"), null, { timeout: 20000 });
        assert.match(await notice(page), /changed on the server/);
        await page.close();
    });
    test("a missing file is an error", async () => {
        const page = await show("?status=404", { wait: false });
        await page.waitForFunction(() => heard.some(({ event }) => event === "error"));
        assert.match(await notice(page), /404/);
        await page.close();
    });
    test("nothing of the last model stays on the page if the next one is missing", async () => {
        const page = await show("");
        await page.evaluate(async () => {
            let point;
            for (let y = 120; !point; y += 4) point = await viewer.positionFromPoint(160, y);
            viewer.innerHTML = `<button slot="hotspot-one" data-position="${point}" id="one">one</button>`;
        });
        await page.waitForFunction(() => one.hasAttribute("data-visible"));
        await page.evaluate(() => (viewer.src += "?status=404"));
        await page.waitForFunction(() => heard.some(({ event }) => event === "error"));
        assert.equal(await page.evaluate(() => one.hasAttribute("data-visible")), false);
        await page.locator("#one").waitFor({ state: "hidden" });
        await page.getByRole("button", { name: "Close" }).click();
        // Between the bar of the progress and the button.
        const clip = { x: 0, y: 4, width: 320, height: 190 };
        const { pixels } = await pictureOf(page, await page.screenshot({ clip }));
        assert.ok(pixels.every((byte) => byte === 255));
        await page.close();
    });
    test("viewer and model may come from another server, which hides Content-Range", async () => {
        const other = await start({ models: [tests.scratch] });
        const page = await tests.open(
            `<pbm-viewer id="viewer" quality="fast" background="#333" camera-orbit="auto auto 45%" src="${other.server.url}/statue.pbvg">`,
            { from: `${other.server.url}/` },
        );
        sameBytes(await pictureOf(page), expected);
        assert.ok(other.server.log.filter((entry) => entry.status === 206).length > 1);
        await page.close();
        await other.close();
    });
    test("a view that moves on cancels what it no longer needs", async () => {
        const page = await show("?rate=60000", { wait: false });
        await page.waitForFunction(() => viewer.loaded, null, { timeout: 20000 });
        await page.evaluate(() => viewer.setCamera({ orbit: "auto auto 5000%" }, { smooth: false }));
        await atRest(page);
        assert.ok(sent() < size, "all of the file was sent");
        await page.close();
    });
});

describe("damage", () => {
    for (const mode of ["ranges", "plain"]) {
        test(`a flipped byte is named with its offset, and the rest is shown (${mode})`, async () => {
            const page = await show(`?mode=${mode}&flip=${lastByte}`, { wait: false });
            await page.waitForFunction(() => heard.some(({ event }) => event === "error"), null, { timeout: 20000 });
            const [error] = await errors(page);
            assert.deepEqual([error.code, error.name.split(".")[0]], [3, "hash"]);
            assert.match(error.rule, /^\d+(\.\d+)+$/);
            assert.match(await notice(page), /^Not all of this model can be shown: the chunk was .*\(byte \d+\)$/);
            assert.ok(error.offset <= lastByte && error.offset > lastByte - 200000, `byte ${error.offset}`);
            await atRest(page);
            const { pixels } = await pictureOf(page);
            const differing = pixels.reduce((sum, byte, i) => sum + (byte !== expected.pixels[i]), 0);
            assert.ok(differing < pixels.length / 10, `${differing} bytes differ`);
            await page.close();
        });
        test(`of a file that is cut short the beginning is shown (${mode})`, async () => {
            const page = await show(`?mode=${mode}&cut=${lastByte - 20000}`, { wait: false });
            await page.waitForFunction(() => viewer.loaded && heard.some(({ event }) => event === "error"), null, {
                timeout: 20000,
            });
            const [error] = await errors(page);
            assert.deepEqual([error.code, error.name], [3, "header.size"]);
            const { pixels } = await pictureOf(page);
            assert.ok(pixels.some((byte) => byte !== 51 && byte !== 255));
            await page.close();
        });
    }
    test("the notice of damage is there again when the network is", async () => {
        const page = await show(`?cut=${lastByte - 20000}&rate=100000`, { wait: false });
        const awaitNotice = (text) =>
            page.waitForFunction(
                (wanted) => viewer.shadowRoot.getElementById("message").textContent.includes(wanted),
                text,
                { timeout: 20000 },
            );
        await awaitNotice("cut short");
        await page.context().setOffline(true);
        await awaitNotice("tries again");
        await page.context().setOffline(false);
        await awaitNotice("cut short");
        await page.close();
    });
    test("of a slow download that ends too early the beginning is shown", async () => {
        const page = await show(`?mode=plain&cut=${lastByte - 20000}&rate=100000`, { wait: false });
        await page.waitForFunction(() => heard.some(({ event }) => event === "error"), null, { timeout: 20000 });
        assert.equal((await errors(page))[0].name, "header.size");
        await atRest(page);
        await page.close();
    });
    for (const [file, name] of [
        ["view_worker.js", "worker"],
        ["pbm.wasm", "module"],
    ]) {
        test(`a viewer without ${file} is told`, async () => {
            const page = await show("", { wait: false, missing: file });
            await page.waitForFunction(() => heard.some(({ event }) => event === "error"), null, { timeout: 20000 });
            assert.equal((await errors(page))[0].name, name);
            await page.close();
        });
    }
    for (const [query, name] of [
        ["?flip=3", "header.magic"],
        ["?flip=60", "hash.header"],
        ["?cut=100", "header.size"],
    ]) {
        test(`a header that is damaged shows nothing but the error (${name})`, async () => {
            const page = await show(query, { wait: false });
            await page.waitForFunction(() => heard.some(({ event }) => event === "error"));
            assert.equal((await errors(page))[0].name, name);
            assert.equal(await page.evaluate(() => viewer.loaded), false);
            await page.close();
        });
    }
    test("memory stays within max-memory", async () => {
        const page = await tests.open(`<pbm-viewer id="viewer" quality="fast" src="statue.pbvg" max-memory="2">`);
        const { heldBytes } = await page.evaluate(() => viewer.statistics());
        assert.ok(heldBytes <= 0.5e6, `${heldBytes} bytes are held`);
        await page.close();
    });
});
