// Bytes of the viewer: the store, planned requests, and sources on servers good and bad.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { fileName, isMixed } from "../viewer/addresses.js";
import { FIRST_BYTES, ForwardedAnswer, forwardAnswer } from "../viewer/answers.js";
import { openBlob, openUrl } from "../viewer/byte_sources.js";
import { ByteStore } from "../viewer/byte_store.js";
import { joined, plan, without } from "../viewer/ranges.js";
import { package_ } from "./browser.mjs";
import { startServer } from "./server.mjs";

const bytes = (from, to) => Uint8Array.from({ length: to - from }, (_, i) => (from + i) % 251);

describe("store", () => {
    test("ranges over several spans are joined", () => {
        const store = new ByteStore();
        store.put(10, bytes(10, 20));
        store.put(30, bytes(30, 40));
        store.put(20, bytes(20, 30));
        assert.deepEqual(store.read(12, 25), bytes(12, 37));
        assert.deepEqual(store.read(30, 10), bytes(30, 40));
        assert.equal(store.held, 30);
    });
    test("what is missing is noted, and what is here stays", () => {
        const store = new ByteStore();
        store.put(10, bytes(10, 20));
        assert.equal(store.read(5, 30), null);
        assert.deepEqual(store.takeLacking(), [
            [5, 10],
            [20, 35],
        ]);
        assert.deepEqual(store.takeLacking(), []);
        store.put(0, new Uint8Array(40));
        assert.deepEqual(store.read(10, 10), bytes(10, 20));
        assert.equal(store.held, 40);
    });
    test("random puts and reads agree with one array", () => {
        let seed = 7;
        const random = (n) => (seed = (seed * 48271) % 2147483647) % n;
        const store = new ByteStore();
        const here = new Uint8Array(1000);
        for (let i = 0; i < 2000; ++i) {
            const from = random(1000);
            const to = Math.min(1000, from + 1 + random(40));
            if (random(3) === 0) {
                store.put(from, bytes(from, to));
                here.fill(1, from, to);
            } else if (here.subarray(from, to).every(Boolean)) {
                assert.deepEqual(store.read(from, to - from), bytes(from, to));
            } else {
                assert.equal(store.read(from, to - from), null);
                const lacking = store.takeLacking();
                assert.equal(
                    lacking.reduce((sum, [a, b]) => sum + b - a, 0),
                    here.subarray(from, to).filter((x) => !x).length,
                );
            }
        }
        assert.equal(
            store.held,
            here.reduce((sum, x) => sum + x, 0),
        );
    });
    test("over the budget, what was used longest ago is freed", () => {
        const store = new ByteStore(25);
        for (const at of [0, 10, 20]) store.put(at, bytes(at, at + 10));
        store.read(0, 10);
        store.trim();
        assert.equal(store.held, 20);
        assert.deepEqual(store.missing(0, 30), [[10, 20]]);
    });
    test("a small part of a large answer does not keep the answer", () => {
        const store = new ByteStore();
        store.put(10, bytes(10, 1000));
        store.put(0, bytes(0, 1000));
        assert.equal(store.read(0, 10).buffer.byteLength, 10);
    });
});

describe("plans", () => {
    test("near ranges become one request, far ones do not", () => {
        assert.deepEqual(
            joined([
                [100000, 100010],
                [0, 10],
                [20, 30],
                [5, 15],
            ]),
            [
                [0, 30],
                [100000, 100010],
            ],
        );
        assert.deepEqual(
            joined(
                [
                    [0, 10],
                    [10, 20],
                    [21, 30],
                ],
                1,
            ),
            [
                [0, 20],
                [21, 30],
            ],
        );
    });
    test("ranges less others", () => {
        assert.deepEqual(
            without(
                [[0, 100]],
                [
                    [10, 20],
                    [90, 200],
                ],
            ),
            [
                [0, 10],
                [20, 90],
            ],
        );
        assert.deepEqual(
            without(
                [
                    [0, 10],
                    [20, 30],
                ],
                [[5, 25]],
            ),
            [
                [0, 5],
                [25, 30],
            ],
        );
        assert.deepEqual(without([[5, 10]], [[0, 20]]), []);
    });
    test("the most urgent range is requested first", () => {
        const wanted = [
            [900000, 900100],
            [0, 100],
            [500000, 500100],
        ];
        assert.deepEqual(plan(wanted, []).requests, wanted);
    });
    test("bytes that are on their way are not requested again, and requests that nobody wants are cancelled", () => {
        const useful = { at: 0, to: 200000 };
        const useless = { at: 1000000, to: 2000000 };
        const almostDone = { at: 3000000, to: 3000100 };
        const { cancelled, requests } = plan([[100000, 300000]], [useful, useless, almostDone]);
        assert.deepEqual(cancelled, [useless]);
        assert.deepEqual(requests, [[200000, 300000]]);
    });
});

const SIZE = 300000;
const FILE = bytes(0, SIZE);

describe("sources", () => {
    const folder = mkdtempSync(join(tmpdir(), "pbm-bytes-"));
    let server;
    before(async () => {
        writeFileSync(join(folder, "file"), FILE);
        writeFileSync(join(folder, "small"), FILE.subarray(0, 1000));
        writeFileSync(join(folder, "empty"), "");
        server = await startServer([folder]);
    });
    after(() => {
        server.close();
        rmSync(folder, { recursive: true });
    });

    // Opens a source and calls `goOn` whenever something happens, until it returns true.
    function follow(path, goOn, { budget = Infinity, open = openUrl } = {}) {
        server.log.length = 0;
        const store = new ByteStore(budget);
        const heard = { failures: [], waits: [] };
        return new Promise((resolve) => {
            let over = false;
            const look = () =>
                queueMicrotask(() => {
                    if (over || !goOn(source, store, heard)) return;
                    over = true;
                    source.close();
                    resolve({ source, store, ...heard });
                });
            const source = open(typeof path === "string" ? server.url + path : path, store, {
                arrived: look,
                failed: (error) => {
                    heard.failures.push(error);
                    look();
                },
                waiting: (error) => {
                    heard.waits.push(error);
                    look();
                },
            });
        });
    }
    const wantAll = (source, store) => {
        if (store.missing(0, SIZE).length === 0) return true;
        source.want(store.missing(0, SIZE));
        return false;
    };
    const sent = () => server.log.reduce((sum, entry) => sum + entry.sent, 0);
    const assertWhole = ({ store, failures }) => {
        assert.deepEqual(failures, []);
        assert.deepEqual(store.read(0, SIZE), FILE);
    };

    test("ranges: the first 64 KB, then what is wanted, no byte twice", async () => {
        const result = await follow("/file", wantAll);
        assertWhole(result);
        assert.equal(result.source.size, SIZE);
        assert.deepEqual(
            server.log.map((entry) => entry.range),
            [`bytes=0-${FIRST_BYTES - 1}`, `bytes=${FIRST_BYTES}-${SIZE - 1}`],
        );
        assert.equal(sent(), SIZE);
    });
    test("ranges: a small file is one request", async () => {
        const { store, source } = await follow(
            "/small",
            (source) => source.size !== null && source.figures.bytes === 1000,
        );
        assert.deepEqual(store.read(0, 1000), FILE.subarray(0, 1000));
        assert.equal(source.figures.requests, 1);
    });
    test("headers that CORS hides are not needed", async () => {
        assertWhole(await follow("/file?hidden=1", wantAll));
        const { source } = await follow("/small?hidden=1", (source) => source.size !== null);
        assert.equal(source.size, 1000);
    });
    test("a view that moved on cancels its requests", async () => {
        let step = 0;
        const { store } = await follow("/file?rate=400000", (source, store) => {
            if (step === 0 && store.held >= FIRST_BYTES) (source.want([[100000, SIZE]]), ++step);
            else if (step === 1 && store.held > FIRST_BYTES) (source.want([[70000, 80000]]), ++step);
            return step === 2 && store.missing(70000, 80000).length === 0;
        });
        assert.ok(store.held < SIZE / 2);
        assert.deepEqual(
            server.log.map((entry) => entry.range?.split("=")[1]),
            ["0-65535", "100000-299999", "70000-79999"],
        );
    });
    test("without ranges the answer to the first request is read to its end", async () => {
        const result = await follow("/file?mode=plain", (source) => source.size !== null);
        assertWhole(result);
        assert.equal(server.log.length, 1);
    });
    test("without ranges, memory ends the download", async () => {
        const { failures, store } = await follow(
            "/file?mode=plain",
            (source, store, { failures }) => failures.length > 0,
            { budget: 150000 },
        );
        assert.equal(failures[0].name, "limit.memory");
        assert.ok(store.held > 0 && store.held <= 150000);
    });
    for (const mode of ["longer", "elsewhere"]) {
        test(`a server that lies about ranges (${mode}) is read once as a whole`, async (t) => {
            const warn = t.mock.method(console, "warn", () => {});
            assertWhole(
                await follow(`/file?mode=${mode}`, (source, store) => store.held === SIZE && source.size !== null),
            );
            assert.match(warn.mock.calls[0].arguments[0], /breaks the rules of range requests/);
            assert.deepEqual(
                server.log.map((entry) => entry.status),
                [206, 200],
            );
        });
    }
    test("answers that are shorter than the range are continued", async () => {
        assertWhole(await follow("/file?mode=shorter", wantAll));
        assert.equal(sent(), SIZE);
    });
    test("a file that changes on the server is an error", async () => {
        const { failures } = await follow("/file?mode=changing", (source, store, { failures }) => {
            source.want(store.missing(0, SIZE));
            return failures.length > 0;
        });
        assert.equal(failures[0].name, "server.changed");
    });
    test("a page in place of the file, once the size is known, is an error", async (t) => {
        t.mock.method(console, "warn", () => {});
        const { failures } = await follow("/file?mode=replaced", (source, store, { failures }) => {
            source.want(store.missing(0, SIZE));
            return failures.length > 0;
        });
        assert.equal(failures[0].name, "server.changed");
    });
    test("a missing file is an error that names the status", async () => {
        const { failures } = await follow("/nothing", (source, store, { failures }) => failures.length > 0);
        assert.match(failures[0].message, /404 Not Found/);
    });
    test("a file that is missing once the server is back ends the wait for it", async () => {
        server.down = true;
        const { failures, waits } = await follow("/nothing", (source, store, { failures, waits }) => {
            if (waits.length > 0) server.down = false;
            return failures.length > 0;
        });
        assert.match(failures[0].message, /404 Not Found/);
        assert.equal(waits.at(-1), null);
    });
    test("an empty file has no bytes", async (t) => {
        t.mock.method(console, "warn", () => {});
        const { source } = await follow("/empty", (source) => source.size !== null);
        assert.equal(source.size, 0);
    });
    test("a connection that breaks once is continued where it broke, and nobody hears of it", async () => {
        const result = await follow("/file?drop=20000", wantAll);
        assertWhole(result);
        assert.deepEqual(result.waits, []);
        assert.equal(sent(), SIZE);
    });
    test("a connection that breaks is continued without ranges", async () => {
        assertWhole(await follow("/file?drop=20000&mode=plain", (source) => source.size !== null));
        assert.equal(server.log[1].range, "bytes=20000-");
    });
    test("a server that is away is asked again until it is back", async () => {
        server.down = true;
        const result = await follow("/file", (source, store, { waits }) => {
            if (waits.length === 2) server.down = false;
            return wantAll(source, store);
        });
        assertWhole(result);
        assert.equal(result.waits.at(-1), null);
    });
    for (const mode of ["ranges", "plain"]) {
        test(`a connection that hangs is told, given up, and what is missing asked for again (${mode})`, async () => {
            server.stalled = true;
            const open = (...given) => openUrl(...given, { patience: 300 });
            const goOn = (source, store, { waits }) => {
                if (waits.length > 0) server.stalled = false;
                return mode === "plain" ? source.size !== null : wantAll(source, store);
            };
            const result = await follow(`/file?mode=${mode}&stall=40000`, goOn, { open });
            assertWhole(result);
            assert.match(result.waits[0].message, /does not answer for file\./);
            assert.equal(result.waits.at(-1), null);
            assert.equal(server.log[1].range, mode === "plain" ? "bytes=65536-" : `bytes=65536-${SIZE - 1}`);
        });
    }
    test("the first answer may come from elsewhere, and nothing is asked for twice", async () => {
        const open = (url, store, listener) => {
            const answer = new ForwardedAnswer(() => {});
            forwardAnswer(url, FIRST_BYTES, ({ type, ...message }) => answer[type](message), new AbortController().signal);
            return openUrl(url, store, listener, { first: answer.response });
        };
        for (const query of ["", "?mode=plain", "?hidden=1", "?drop=20000"]) {
            const goOn = query === "?mode=plain" ? (source) => source.size !== null : wantAll;
            assertWhole(await follow(`/file${query}`, goOn, { open }));
            assert.equal(sent(), SIZE, query);
            assert.equal(server.log[0].range, `bytes=0-${FIRST_BYTES - 1}`);
        }
        const { failures } = await follow("/nothing", (source, store, { failures }) => failures.length > 0, { open });
        assert.equal(failures[0].message, "The server answered 404 Not Found for nothing.");
    });
    test("messages name a file, and no token of its address", () => {
        const names = {
            "https://user:word@host.org/a/b/lion%20one.pbvg?token=secret#x": "lion one.pbvg",
            "https://host.org/?token=secret": "host.org",
            "data:application/octet-stream;base64,AAAA": "data:...",
            "lion.pbvg?token=secret": "lion.pbvg",
            "http://[?token=secret": "http://[",
        };
        for (const [url, name] of Object.entries(names)) assert.equal(fileName(url), name);
        assert.equal(fileName(`https://host.org/${"long".repeat(50)}`).length, 60);
    });
    test("an address that no network leads to is an error at once", async () => {
        const url = URL.createObjectURL(new Blob([FILE]));
        URL.revokeObjectURL(url);
        for (const address of [url, "foo:bar", "javascript:1"]) {
            const isOver = (source, store, { failures }) => failures.length > 0;
            const open = (_, ...rest) => openUrl(address, ...rest);
            const { failures, waits } = await follow(null, isOver, { open });
            assert.deepEqual([failures[0].name, waits.length], ["address", 0]);
        }
    });
    test("an address of http: that a page of https: may not load is named", async () => {
        globalThis.origin = "https://museum.example";
        try {
            const isOver = (source, store, { failures, waits }) => failures.length + waits.length > 0;
            const open = (_, ...rest) => openUrl("http://scans.invalid/lion.pbvg?token=secret", ...rest);
            const { failures } = await follow(null, isOver, { open });
            assert.equal(failures[0]?.message, "lion.pbvg is not loaded: a page of https: may not load from http:.");
        } finally {
            delete globalThis.origin;
        }
        for (const [url, origin] of [["http://localhost/a", "https://a"], ["https://b/a", "https://a"], ["http://b/a", "http://a"]])
            assert.equal(isMixed(url, origin), false, url);
    });
    test("a Blob is read by slices", async () => {
        const result = await follow(new Blob([FILE]), wantAll, { open: openBlob });
        assertWhole(result);
        assert.equal(result.source.size, SIZE);
        assert.equal(result.source.figures.bytes, SIZE);
    });
});
