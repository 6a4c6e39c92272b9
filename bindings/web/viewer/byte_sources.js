// Where the bytes of a model come from. A source puts bytes into a ByteStore as they arrive:
//
//   openUrl   requests ranges, if the server answers the first one; else reads the one answer as it arrives
//   openBlob  reads slices of a Blob
//
// Both return a source:
//   size         bytes that the file has on the server or disk; null while unknown
//   want(ranges) fetch these ([from, to], most urgent first) and nothing else; requests that run and bring none of
//                them are cancelled
//   close()      ends everything
//   figures      {bytes, requests}: bytes that arrived and requests that were made
//
// `listener` hears of what happens:
//   arrived()                   there are new bytes, or the size is known
//   failed(error)               a SourceError; no further bytes will come
//   waiting(error, times)       the network failed this many times in a row, and the source tries again; 0 times: the
//                               server does not answer, and the source waits; null: it is back. A first failure that
//                               the next attempt mends is not told
import { CODES } from "../module/errors.js";
import { isPassing } from "../module/wasm_file.js";
import { fileName, isAnswered, isElsewhere, isMixed } from "./addresses.js";
import { FIRST_BYTES } from "./answers.js";
import { plan } from "./ranges.js";
import { textOf } from "./texts.js";

const PARALLEL = 3;
const FIRST_DELAY = 500; // ms before the first repetition; doubled each time
const LONGEST_DELAY = 15000;
// Failures in a row before the first answer, from which on each repetition tries without Range, too: browsers refuse
// a server that compresses what it answers to a range.
const RANGES_TRIED = 2;
const FAILURES_TOLD = 2; // in a row, before the listener hears of them
const PATIENCE = 10000; // ms without a byte, until the listener hears of it and the connection is given up; see #patience
const LONGEST_PATIENCE = 80000;

// `key` and `values`: of a text of texts.js.
export class SourceError extends Error {
    constructor(name, key, values = {}, code = CODES.IO) {
        super(textOf("en", key, values));
        Object.assign(this, { name, code, offset: null, key, values });
    }
}

function changed() {
    return new SourceError("server.changed", "changed");
}

const NO_ANSWER = "no answer";

// Rejects when the signal aborts, with its reason.
function aborted(signal) {
    const promise = new Promise((_, reject) => {
        if (signal.aborted) reject(signal.reason);
        signal.addEventListener("abort", () => reject(signal.reason), { once: true });
    });
    promise.catch(() => {}); // nobody may be waiting
    return promise;
}

// The server breaks the rules of range requests (RFC 9110, section 14).
class RangeLie extends Error {}

// `Content-Range: bytes 0-99/1000` as {from, to, size}, or null: absent, or hidden from scripts by CORS.
function contentRange(response) {
    const header = response.headers.get("content-range");
    if (header === null) return null;
    const parts = /^bytes (\d+)-(\d+)\/(\d+|\*)$/.exec(header);
    if (!parts) throw new RangeLie(`it sent "Content-Range: ${header}"`);
    return { from: +parts[1], to: +parts[2] + 1, size: parts[3] === "*" ? null : +parts[3] };
}

// `options`
//   first      promise of the answer to the first request, if somebody else has made it already
//   patience   in place of PATIENCE
//   violation  () => the directive of the Content-Security-Policy that this address broke, or null
export function openUrl(url, store, listener, options = {}) {
    return new UrlSource(url, store, listener, options);
}

class UrlSource {
    size = null;
    figures = { bytes: 0, requests: 0 };
    #url;
    #store;
    #listener;
    #running = new Set(); // {from, at, to, abort}
    #queue = []; // ranges to request, most urgent first
    #streamed = false; // the server answers without ranges
    #version = null; // validator of the file on the server: ETag, or its date
    #stated = null; // size, while the server still answered ranges
    #closed = new AbortController();
    #failures = 0; // in a row
    #withoutRange = false; // the next request
    #first; // answer to the first request, until it is used
    #patience; // ms; twice as long after each connection that was given up: a slow server may need it
    #violation;
    #stalled = false;
    #pause = null; // promise while waiting for the network

    constructor(url, store, listener, { first = null, patience = PATIENCE, violation = () => null }) {
        this.#url = url;
        this.#store = store;
        this.#listener = listener;
        this.#first = first;
        this.#patience = patience;
        this.#violation = violation;
        this.#start([0, FIRST_BYTES]);
    }

    want(ranges) {
        if (this.#streamed || this.figures.bytes === 0 || this.#closed.signal.aborted) return;
        const { cancelled, requests } = plan(ranges, [...this.#running]);
        for (const request of cancelled) request.abort.abort();
        this.#queue = requests;
        this.#next();
    }

    close() {
        this.#closed.abort();
        this.#queue = [];
        for (const request of this.#running) request.abort.abort();
    }

    #next() {
        while (this.#running.size < PARALLEL && this.#queue.length > 0) this.#start(this.#queue.shift());
    }

    async #start([from, to]) {
        const request = { from, at: from, to, abort: new AbortController() };
        this.#running.add(request);
        try {
            await this.#repeat(request);
        } catch (error) {
            if (request.abort.signal.aborted) return;
            if (error instanceof RangeLie && !this.#streamed) this.#readWhole(error);
            else this.#fail(error);
        } finally {
            this.#running.delete(request);
            this.#next();
        }
    }

    // Watches a connection on which bytes are expected: gives it up when none come. expect() starts anew.
    #watch(connection) {
        let timer;
        const stop = () => clearTimeout(timer);
        const expect = () => {
            stop();
            timer = setTimeout(() => {
                this.#stalled = true;
                this.#patience = Math.min(this.#patience * 2, LONGEST_PATIENCE);
                this.#listener.waiting(new SourceError("network", "silent", { name: fileName(this.#url) }), 0);
                connection.abort(new Error(NO_ANSWER));
            }, this.#patience);
        };
        connection.signal.addEventListener("abort", stop);
        expect();
        return { expect, stop };
    }

    // Until all bytes are here. Only what the network is to blame for is repeated.
    async #repeat(request) {
        while (request.at < request.to) {
            await this.#pause;
            if (request.abort.signal.aborted) return;
            try {
                await this.#fetch(request);
            } catch (error) {
                if (request.abort.signal.aborted) return;
                if (error instanceof RangeLie || error instanceof SourceError) throw error;
                await this.#throwIfHopeless(error);
                if (request.abort.signal.aborted) return;
                this.#withoutRange =
                    !this.#withoutRange && this.figures.bytes === 0 && this.#failures >= RANGES_TRIED;
                if (!this.#withoutRange) this.#wait(error);
            }
        }
    }

    // Throws a SourceError if no repetition can help.
    async #throwIfHopeless({ message: reason }) {
        const name = fileName(this.#url);
        const origin = globalThis.origin ?? "null";
        if (!/^https?:/.test(this.#url)) throw new SourceError("address", "unreadable", { name, reason });
        if (isMixed(this.#url, origin)) throw new SourceError("address", "mixed", { name });
        const directive = this.#violation();
        if (directive) throw new SourceError("policy", "forbidden", { name, directive });
        // Browsers do not tell a missing permission from a missing network.
        const isUnread = this.figures.bytes === 0 && this.#failures >= RANGES_TRIED && isElsewhere(this.#url, origin);
        if (isUnread && reason !== NO_ANSWER && (await isAnswered(this.#url)))
            throw new SourceError("server.foreign", "foreign", { name });
    }

    async #fetch(request) {
        const asked = { from: request.at, to: request.to };
        const whole = (this.#streamed || this.#withoutRange) && asked.from === 0;
        const connection = new AbortController();
        const end = () => connection.abort();
        request.abort.signal.addEventListener("abort", end);
        const watch = this.#watch(connection);
        this.figures.requests += 1;
        try {
            const response = await (this.#takeFirst(connection.signal) ??
                fetch(this.#url, {
                    headers: whole ? {} : { Range: `bytes=${asked.from}-${Number.isFinite(asked.to) ? asked.to - 1 : ""}` },
                    signal: connection.signal,
                }));
            this.#checkStatus(response);
            this.#checkVersion(response);
            const body = { response, watch, signal: connection.signal };
            if (response.status === 206) return await this.#takeRange(request, body, asked);
            if (!this.#streamed && this.size !== null)
                throw new RangeLie("it answered some ranges, and then the whole file");
            this.#streamed = true;
            this.#queue = [];
            request.to = Infinity;
            await this.#takeBody(request, body, 0);
            this.#setEnd(request);
        } finally {
            watch.stop();
            request.abort.signal.removeEventListener("abort", end);
        }
    }

    // The answer that was asked for before, once; null if there is none. Rejects when the signal aborts.
    #takeFirst(signal) {
        const first = this.#first;
        this.#first = null;
        return first && Promise.race([first, aborted(signal)]);
    }

    #checkStatus({ status, statusText }) {
        if (status === 200 || status === 206) return;
        if (status === 416) throw new RangeLie("it answered 416 to a range inside the file");
        const answer = `${status} ${statusText}`.trim();
        if (isPassing(status)) throw new Error(`HTTP ${answer}`);
        throw new SourceError("server.status", "status", { status: answer, name: fileName(this.#url) });
    }

    #checkVersion(response) {
        const version = response.headers.get("etag") ?? response.headers.get("last-modified");
        if (this.#version !== null && version !== null && version !== this.#version) throw changed();
        this.#version ??= version;
    }

    async #takeRange(request, body, asked) {
        const range = contentRange(body.response);
        let end = asked.to;
        if (range) {
            end = Math.min(asked.to, range.size ?? asked.to);
            if (range.from !== asked.from || range.to <= range.from || range.to > end)
                throw new RangeLie(
                    `it sent bytes ${range.from} to ${range.to} where ${asked.from} to ${end} were asked for`,
                );
            if (this.size !== null && range.size !== null && range.size !== this.size)
                throw new RangeLie(`it states a size of ${range.size} bytes, and stated ${this.size} before`);
            this.size ??= range.size;
            request.to = end;
            end = range.to;
        }
        await this.#takeBody(request, body, asked.from, end);
        if (request.at === asked.from) throw new Error("The server sent no bytes.");
        if (range) return;
        // CORS hides Content-Range. An answer that ends early ends with the file.
        if (request.at < request.to) this.#setEnd(request);
    }

    #setEnd(request) {
        if (this.#stated !== null && request.at !== this.#stated) throw changed();
        this.size = request.at;
        request.to = request.at;
        this.#listener.arrived();
    }

    // Puts the bytes of an answer that begin at `offset` into the store, and no byte from `end` on.
    async #takeBody(request, { response, watch, signal }, offset, end = Infinity) {
        const reader = response.body.getReader();
        const gone = aborted(signal);
        gone.catch(() => reader.cancel().catch(() => {}));
        for (let at = offset; ;) {
            const { done, value } = await Promise.race([reader.read(), gone]);
            if (done) return;
            watch.expect();
            this.#recover();
            this.figures.bytes += value.length;
            if (at + value.length > end)
                throw new RangeLie(`it sent more than the ${end - offset} bytes that it announced`);
            if (this.#streamed && at + value.length > this.#store.budget)
                throw new SourceError("limit.memory", "tooLarge", {}, CODES.LIMIT);
            this.#store.put(at, value);
            at += value.length;
            request.at = Math.max(request.at, at);
            this.#listener.arrived();
        }
    }

    // The server lies about ranges: one plain request instead, and none of its bytes is kept.
    #readWhole(lie) {
        console.warn(
            `pbm-viewer: the server breaks the rules of range requests for ${fileName(this.#url)}: ${lie.message}.` +
                " The viewer reads the whole file instead.",
        );
        for (const request of this.#running) request.abort.abort();
        this.#store.clear();
        this.#streamed = true;
        this.#queue = [];
        this.#stated = this.size;
        this.size = null;
        this.#start([0, Infinity]);
    }

    #wait(error) {
        if (this.#pause) return;
        const delay = Math.min(FIRST_DELAY * 2 ** this.#failures, LONGEST_DELAY);
        this.#failures += 1;
        if (this.#failures >= FAILURES_TOLD) {
            const values = { name: fileName(this.#url), reason: error.message };
            this.#listener.waiting(new SourceError("network", "again", values), this.#failures);
        }
        this.#pause = new Promise((resolve) => {
            const go = () => {
                clearTimeout(timer);
                globalThis.removeEventListener?.("online", go);
                this.#pause = null;
                resolve();
            };
            const timer = setTimeout(go, delay);
            globalThis.addEventListener?.("online", go);
        });
    }

    #recover() {
        const wasTold = this.#failures >= FAILURES_TOLD || this.#stalled;
        this.#failures = 0;
        this.#stalled = false;
        if (wasTold) this.#listener.waiting(null, 0);
    }

    #fail(error) {
        if (this.#closed.signal.aborted) return;
        this.close();
        this.#recover(); // no notice of the network hides the error
        this.#listener.failed(
            error instanceof SourceError
                ? error
                : new SourceError("server.ranges", "ranges", { name: fileName(this.#url), reason: error.message }),
        );
    }
}

export function openBlob(blob, store, listener) {
    let closed = false;
    let queue = [];
    let running = false;
    const figures = { bytes: 0, requests: 0 };
    async function read() {
        if (running) return;
        running = true;
        try {
            while (queue.length > 0 && !closed) {
                const [from, to] = queue.shift();
                const bytes = new Uint8Array(await blob.slice(from, to).arrayBuffer());
                figures.bytes += bytes.length;
                figures.requests += 1;
                store.put(from, bytes);
                if (!closed) listener.arrived();
            }
        } catch {
            if (!closed) listener.failed(new SourceError("file", "fileGone"));
        }
        running = false;
    }
    const source = {
        size: blob.size,
        figures,
        want(ranges) {
            queue = plan(ranges, []).requests;
            read();
        },
        close() {
            closed = true;
        },
    };
    source.want([[0, Math.min(blob.size, FIRST_BYTES)]]);
    return source;
}
