// The page of the validator in Chromium.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { golden, programs, start } from "./browser.mjs";

let tests;
before(async () => {
    tests = await start();
});
after(() => tests.close());

async function examine(name, buffer) {
    const page = await tests.browser.newPage();
    const faults = [];
    page.on("pageerror", (error) => faults.push(String(error)));
    page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
    await page.route("**/favicon.ico", (route) => route.fulfill({ status: 204 }));
    await page.goto(`${tests.server.url}/validator.html`);
    await page.locator("#file").setInputFiles({ name, mimeType: "", buffer });
    await page.locator("#verdict").waitFor();
    assert.deepEqual(faults, []);
    return page;
}
const MODEL = readFileSync(join(golden, "1.0/scan-plain.pbvg"));

test("a valid file is valid", async () => {
    const page = await examine("scan-plain.pbvg", MODEL);
    assert.equal(await page.locator("#verdict").innerText(), "scan-plain.pbvg is valid");
    assert.match(await page.locator("#counts").innerText(), /points verified; 0 errors/);
    await page.close();
});
test("findings are those of pbm-validate --deep, and codes lead to their page", async () => {
    const damaged = Buffer.from(MODEL);
    damaged[damaged.length - 20] ^= 1;
    const file = join(tests.scratch, "damaged.pbvg");
    writeFileSync(file, damaged);
    const { stdout, status } = spawnSync(join(programs, "pbm-validate"), ["--deep", "--json", file], {
        encoding: "utf8",
    });
    assert.equal(status, 3);
    const expected = JSON.parse(stdout).files[0].findings.map(
        ({ severity, code, rule, offset, section, message, remedy }) => [
            severity,
            code,
            rule,
            offset.toLocaleString("en"),
            section,
            message.replace(`${rule} `, ""),
            remedy,
        ],
    );
    assert.ok(expected.every(([, , rule]) => rule));
    const page = await examine("damaged.pbvg", damaged);
    assert.equal(await page.locator("#verdict").innerText(), "damaged.pbvg is not valid");
    assert.match(await page.locator("#counts").innerText(), /; 2 errors, 0 warnings, 0 notes$/);
    const rows = await page
        .locator("tbody tr")
        .evaluateAll((rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent)));
    assert.deepEqual(rows, expected);
    await page.locator("tr.error a").first().click();
    await page.locator(`tr[id="${expected[0][1]}"]`).waitFor();
    await page.close();
});
test("something else is refused, and markup in names stays text", async () => {
    const page = await examine("<img src=x onerror=alert(1)>.pbvg", Buffer.from("solid teapot"));
    assert.match(await page.locator("#verdict").innerText(), /^<img src=x onerror=alert\(1\)>.pbvg is not valid$/);
    assert.match(await page.locator("#counts").innerText(), /^12 bytes, 0 points verified; 1 error, /);
    await page.close();
});
test("a file may be dropped", async () => {
    const page = await tests.browser.newPage();
    await page.goto(`${tests.server.url}/validator.html`);
    await page.evaluate(
        (bytes) => {
            const transfer = new DataTransfer();
            transfer.items.add(new File([new Uint8Array(bytes)], "dropped.pbvg"));
            document
                .getElementById("drop")
                .dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
        },
        [...MODEL],
    );
    await page.locator("#verdict").waitFor();
    assert.equal(await page.locator("#verdict").innerText(), "dropped.pbvg is valid");
    await page.close();
});
test("nothing can leave the page: not from it, and not from its worker", async () => {
    const other = await start();
    const page = await examine("scan-plain.pbvg", MODEL);
    const attempt = async (url) =>
        fetch(url, { mode: "no-cors" }).then(
            () => "sent",
            () => "refused",
        );
    const elsewhere = `${other.server.url}/pbm-viewer.js`;
    assert.equal(await page.evaluate(attempt, elsewhere), "refused");
    assert.equal(await page.workers()[0].evaluate(attempt, elsewhere), "refused");
    assert.equal(await page.workers()[0].evaluate(attempt, `${tests.server.url}/pbm.js`), "sent");
    assert.deepEqual(other.server.log, []);
    await page.close();
    await other.close();
});
